"""`simplexmesh decimate`: reduce the number of vertices of a model, keeping its shape and topology."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh.cli import report

EXAMPLE = (
    "Examples: simplexmesh decimate head.vtp --vertices 2000 -o small.vtp ;  "
    "simplexmesh decimate part.stl --tolerance 0.05 -o part.vtp"
)


def command(
    path: Annotated[
        Path, typer.Argument(metavar="INPUT", help="A model, or triangles, which are converted to their dual.")
    ],
    output: report.Model,
    vertices: Annotated[int | None, typer.Option(help="Number of vertices to keep, even.")] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Or: the largest distance allowed, in the unit of the file.")
    ] = None,
    json: report.Json = False,
) -> None:
    """Remove vertices where they affect the surface least; genus, components and holes are kept."""
    output = report.writable(output, "--output", inputs=[path])
    if (vertices is None) == (tolerance is None):
        raise ValueError("give --vertices or --tolerance" + ("" if vertices is None else ", not both"))

    with report.work("decimating", wanted=not json) as (interrupts, reported):
        from simplexmesh.data.decimate import decimate

        began = time.perf_counter()
        reported(0.0, "reading")
        mesh = loaded(path)
        reported(0.2, f"{mesh.n_vertices:,} vertices")
        result = decimate(mesh, vertices=vertices, tolerance=tolerance)
        seconds = time.perf_counter() - began
        reported(0.9, "checking")
        facts = described(mesh, result) | {"seconds": round(seconds, 3), "output": str(output)}
        interrupts.check()
        with report.written_to(output, "the model"):
            result.mesh.save(output)
    for problem in facts["problems"]:
        report.note(f"the model has a defect: {problem}")
    if facts["problems"] and (older := mesh.check(self_intersections=True).problems):
        report.note(f"so had the input: {'; '.join(older)}")
    report.tell(facts, str(output), _rows(facts), json=json)


def loaded(path: Path) -> Any:
    """Return the mesh in a file; of triangles, the dual, with a note."""
    from simplexmesh._base.errors import TopologyError
    from simplexmesh.data.io.reading import read
    from simplexmesh.data.triangles import TriangleMesh
    from simplexmesh.mesh.duality import dual
    from simplexmesh.mesh.simplex_mesh import SimplexMesh

    found = read(path)
    if isinstance(found, SimplexMesh):
        return found
    if not isinstance(found, TriangleMesh):
        raise ValueError(
            f"INPUT must hold a model or triangles, {path.name} holds a {type(found).__name__}: "
            "use simplexmesh reconstruct to make a model of it"
        )
    try:
        mesh = dual(found)
    except TopologyError as problem:
        raise TopologyError(f"{path.name}: {problem}") from None
    report.note(
        f"{path.name} holds {found.n_faces:,} triangles; their dual, {mesh.n_vertices:,} vertices, is decimated"
    )
    return mesh


def described(before: Any, result: Any) -> dict[str, Any]:
    """Return the report of a decimation: sizes, distances, and the defects of the mesh."""
    from simplexmesh.motion.model.state import mean_edge

    mesh, (low, high) = result.mesh, before.bounds
    return {
        **report.mesh_numbers(mesh),
        "mean_edge": mean_edge(mesh),
        "before": report.mesh_numbers(before),
        "diagonal": float(((high - low) ** 2).sum() ** 0.5),
        "rms": result.rms,
        "largest": result.largest,
        "exceptions": len(result.exceptions),
        "problems": list(mesh.check(self_intersections=True).problems),
    }


def _rows(facts: dict[str, Any]) -> dict[str, str]:
    """Return the rows of the table."""
    before, odd = facts["before"], facts["exceptions"]
    return {
        "before": f"{before['vertices']:,} vertices, {before['faces']:,} faces",
        **report.mesh_rows(facts),
        "distance": f"rms {_part(facts['rms'], facts)}, largest {_part(facts['largest'], facts)}",
        "faces": "of five to seven vertices" + (f", except {odd:,}" if odd else ""),
        "problems": "\n".join(facts["problems"]) or "none",
        "time": f"{facts['seconds']:.1f} s",
    }


def _part(length: float, facts: dict[str, Any]) -> str:
    """Return a length as text, with its share of the diagonal."""
    return f"{length:.4g} ({100 * length / facts['diagonal']:.3g} %)" if facts["diagonal"] else f"{length:.4g}"
