"""`simplexmesh info`: the contents of a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh._base.interrupts import deferred_interrupts
from simplexmesh._base.progress import announce_compiling
from simplexmesh.cli import report

EXAMPLE = "Example: simplexmesh info head.vtp"


def command(
    inputs: Annotated[list[Path], typer.Argument(metavar="FILE", help="Volumes, surfaces, points, models, libraries.")],
    json: Annotated[
        bool, typer.Option("--json", help="Print a JSON object; for several files, a list of them named files.")
    ] = False,
) -> None:
    """Describe a file: kind, size, range, extent; for a model also its topology, geometry and defects."""
    with deferred_interrupts() as interrupts:  # an interrupt during the import of VTK can crash the process
        from simplexmesh.data.io.reading import read

        announce_compiling()
        found = []
        for path in inputs:
            facts = _library(path) or described(read(path))
            found.append({"file": str(path)} | facts)
            interrupts.check()
    if json:
        report.as_json(found[0] if len(found) == 1 else {"files": found})
        return
    for facts in found:
        report.table(str(facts.pop("file")), {name.replace("_", " "): _as_text(value) for name, value in facts.items()})


def described(thing: Any) -> dict[str, Any]:
    """Return the report of an object read from a file, in order."""
    from simplexmesh.data.points import PointCloud
    from simplexmesh.data.triangles import TriangleMesh
    from simplexmesh.data.volume import Volume

    if isinstance(thing, Volume):
        return _volume(thing)
    if isinstance(thing, PointCloud):
        facts = {"kind": "points", "points": len(thing), "normals": thing.normals is not None}
    elif isinstance(thing, TriangleMesh):
        facts = _triangles(thing)
    else:
        problems = list(thing.check(self_intersections=True).problems)
        facts = {"kind": "simplex mesh", **report.mesh_numbers(thing), "problems": problems}
    return facts | {"arrays": sorted(thing.data), "unit": thing.unit} | _extent(thing.bounds)


def _library(path: Path) -> dict[str, Any] | None:
    """Return the report of a model library, None for any other file."""
    if path.suffix.lower() != ".sml" or not path.is_file() or not path.stat().st_size:
        return None
    from simplexmesh.recognition.library.library import ModelLibrary

    return {"kind": "model library", "models": list(ModelLibrary(path).names)}


def _volume(volume: Any) -> dict[str, Any]:
    facts = {
        "kind": "label map" if volume.is_labels else "volume",
        "shape": list(volume.shape),
        "type": str(volume.values.dtype),
        "range": list(volume.range),
        "spacing": volume.spacing.tolist(),
        "origin": volume.origin.tolist(),
        "direction": volume.direction.tolist(),
    }
    if volume.is_labels:
        facts["labels"] = volume.labels()
    return facts | {"unit": volume.unit} | _extent(volume.bounds)


def _triangles(mesh: Any) -> dict[str, Any]:
    from simplexmesh._base.errors import TopologyError

    facts = {"kind": "triangles", "vertices": mesh.n_vertices, "faces": mesh.n_faces, "closed": mesh.is_closed}
    problems = []
    try:
        found = mesh.topology
        facts |= {"genus": found.genus, "borders": found.n_borders, "components": found.n_components}
    except TopologyError as problem:
        problems.append(str(problem))
    facts["area"] = mesh.area
    if mesh.is_closed:
        facts["volume"] = mesh.volume
        if mesh.volume < 0:
            problems.append("the faces are oriented inward")
    return facts | {"problems": problems}


def _extent(bounds: Any) -> dict[str, Any]:
    low, high = bounds.tolist()
    return {"low": low, "high": high, "extent": [b - a for a, b in zip(low, high, strict=True)]}


def _as_text(value: Any) -> str:
    """Return a value as text."""
    if value is None:
        return "unknown"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        row = "; " if value and isinstance(value[0], list | str) else ", "
        return row.join(_as_text(inner) for inner in value) or "none"
    return str(value)
