"""`simplexmesh features`: the sharp edges of a surface, and its zones."""

from __future__ import annotations

import math
import re
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh.cli import report
from simplexmesh.data.json_text import json_text

EXAMPLE = "Example: simplexmesh features fandisk.off -o fandisk.vtp --picture fandisk.png"
ENDINGS = (".vtp", ".json", ".stl")
ROUNDING = 1e-9
"""Distances smaller than this, in roots of the area, are zero in the table."""


def command(
    path: Annotated[Path, typer.Argument(metavar="INPUT", help="Triangles, or a model, which is triangulated.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="File to write: .vtp (zones and lines), .json, or .stl (one per zone)."),
    ] = None,
    angle: Annotated[
        float | None, typer.Option(help="Least angle of a sharp edge, in degrees; the default sees the noise.")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Also divide where the curvature, 1 / length, differs by this.")
    ] = None,
    picture: report.Picture = None,
    side: report.View = "iso",
    up: report.Up = "auto",
    json: report.Json = False,
) -> int | str:
    """Find the sharp edges of a surface, and the zones between them."""
    output = output and _target(output, path)
    picture = picture and report.writable(picture, "--picture", report.PICTURES, [path])
    camera = report.camera(side, up, drawn=picture is not None)
    if angle is not None and not 0 < angle < 180:
        raise ValueError(f"--angle must lie between 0 and 180 degrees, not {angle:g}")

    with report.work("features", wanted=not json) as (interrupts, reported):
        began = time.perf_counter()
        reported(0.0, "reading")
        zones = found(path, angle, tolerance, reported)
        facts = described(zones)
        facts |= {"seconds": round(time.perf_counter() - began, 3), "output": output and str(output)}
        interrupts.check()
        if output is not None:
            reported(0.8, "writing")
            _write(zones, output)
        if interrupts.pending and output is not None and picture is not None:
            report.note(f"interrupted; {output} was written, {picture} was not")
            return report.KEPT
        if picture is not None:
            reported(0.9, "drawing")
        report.draw(picture, lambda plot: plot.features(zones.mesh, None, zones, title=path.name, **camera))
    report.tell(facts, str(output or path), _rows(facts), json=json)
    return 0


def _target(output: Path, path: Path) -> Path:
    """Return the path to write to, checked; files of zones must not replace the input either."""
    output = report.writable(output, "--output", ENDINGS, [path])
    numbered = re.fullmatch(re.escape(output.stem) + r"_\d+", path.stem) and path.suffix == output.suffix
    if output.suffix.lower() == ".stl" and numbered and path.parent.resolve() == output.parent.resolve():
        raise ValueError(f"--output must not lead to the input file {str(path)!r}: zones get numbered names")
    return output


def found(path: Path, angle: float | None, tolerance: float | None, reported: Any) -> Any:
    """Return the zones of the surface in a file."""
    from simplexmesh._base.errors import TopologyError
    from simplexmesh.data.io.reading import read
    from simplexmesh.data.triangles import TriangleMesh
    from simplexmesh.mesh.simplex_mesh import SimplexMesh
    from simplexmesh.surface.features.feature_lines import feature_lines
    from simplexmesh.surface.features.zones import zones

    surface = read(path)
    if not isinstance(surface, TriangleMesh | SimplexMesh):
        raise ValueError(f"INPUT must hold triangles or a model, {path.name} holds a {type(surface).__name__}")
    reported(0.2, f"{surface.n_faces:,} faces")
    try:
        network = feature_lines(surface, angle=None if angle is None else math.radians(angle))
        reported(0.6, "zones")
        return zones(network.mesh, network, tolerance=tolerance)
    except TopologyError as problem:
        raise TopologyError(f"{path.name}: {problem}") from None


def described(zones: Any) -> dict[str, Any]:
    """Return the report: counts, the noise, and what each zone is."""
    network = zones.network
    return {
        "vertices": zones.mesh.n_vertices,
        "triangles": zones.mesh.n_faces,
        "lines": len(network.lines),
        "nodes": len(network.nodes),
        "length": sum(line.length for line in network.lines),
        "noise": network.noise,
        "zones": zones.as_dict()["zones"],
    }


def _write(zones: Any, output: Path) -> None:
    """Write zones and lines; of STL files the number is told."""
    if output.suffix.lower() == ".stl":
        zones.save(output)
        report.note(f"zones were written to {output.stem}_0{output.suffix} and so on, {len(zones)} in all")
        return
    with report.written_to(output, "the file"):
        if output.suffix.lower() == ".vtp":
            zones.save(output)
        else:
            from simplexmesh._base.drafts import draft

            with draft(output) as part:
                part.write_text(json_text(zones.network.as_dict() | zones.as_dict()), encoding="utf-8")


def _rows(facts: dict[str, Any]) -> dict[str, str]:
    """Return the rows of the table."""
    return {
        "surface": f"{facts['vertices']:,} vertices, {facts['triangles']:,} triangles",
        "lines": f"{facts['lines']:,}, length {facts['length']:.6g}, {facts['nodes']:,} nodes",
        "noise": f"{facts['noise']:.3g}",
        "zones": _zones(facts["zones"]),
        "time": f"{facts['seconds']:.1f} s",
    }


def _zones(zones: list[dict[str, Any]]) -> str:
    """Return a table of the zones, the largest first."""
    size, rows = math.sqrt(sum(zone["area"] for zone in zones)), []
    for k, zone in enumerate(zones):
        rms = "" if zone["rms"] is None else f"{zone['rms'] if zone['rms'] > ROUNDING * size else 0.0:.3g}"
        rows.append([f"{k}", zone["kind"], rms, f"{zone['area']:.4g}", f"{zone['triangles']:,}"])
    return f"{len(zones):,}\n" + report.columns(("", "kind", "rms", "area", "triangles"), rows, "smaller ones")
