"""`simplexmesh decimate`: reduce the number of vertices of a model, keeping its shape and topology."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh.cli.interrupt import deferred_interrupts
from simplexmesh.cli.report import MODELS, NOTES, as_json, mesh_numbers, note, progress, table, writable, written_to

EXAMPLE = (
    "Examples: simplexmesh decimate head.vtp --vertices 2000 -o small.vtp ;  "
    "simplexmesh decimate part.stl --tolerance 0.05 -o part.vtp"
)


def command(
    path: Annotated[
        Path, typer.Argument(metavar="INPUT", help="A model, or triangles, which are converted to their dual.")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Model to write: .vtp (keeps everything), .ply, .obj, .off, .stl.")
    ],
    vertices: Annotated[int | None, typer.Option(help="Number of vertices to keep, even.")] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Or: the largest distance allowed, in the unit of the file.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Remove vertices where they affect the surface least; genus, components and holes are kept."""
    output = writable(output, "--output", MODELS, [path])
    if (vertices is None) == (tolerance is None):
        raise ValueError("give --vertices or --tolerance" + ("" if vertices is None else ", not both"))

    with deferred_interrupts() as interrupts, progress("decimating", wanted=not json) as report:
        from simplexmesh.mesh.decimate import decimate

        reported = interrupts.checking(report)
        began = time.perf_counter()
        reported(0.0, "reading")
        mesh = loaded(path)
        reported(0.2, f"{mesh.n_vertices:,} vertices")
        result = decimate(mesh, vertices=vertices, tolerance=tolerance)
        seconds = time.perf_counter() - began
        reported(0.9, "checking")
        facts = described(mesh, result) | {"seconds": round(seconds, 3), "output": str(output)}
        interrupts.check()
        with written_to(output, "the model"):
            result.mesh.save(output)
    for problem in facts["problems"]:
        note(f"the model has a defect: {problem}")
    if facts["problems"] and (older := mesh.check(self_intersections=True).problems):
        note(f"so had the input: {'; '.join(older)}")
    if json:
        as_json(facts | {"notes": NOTES})
    else:
        _print(facts, output)


def loaded(path: Path) -> Any:
    """Return the mesh in a file; of triangles, the dual, with a note."""
    from simplexmesh.data.reading import read
    from simplexmesh.data.triangles import TriangleMesh
    from simplexmesh.errors import TopologyError
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
    note(f"{path.name} holds {found.n_faces:,} triangles; their dual, {mesh.n_vertices:,} vertices, is decimated")
    return mesh


def described(before: Any, result: Any) -> dict[str, Any]:
    """Return the report of a decimation: sizes, distances, and the defects of the mesh.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(8)
    >>> facts = described(ball, sm.decimate(ball, vertices=400))
    >>> facts["before"]["vertices"], facts["vertices"], facts["genus"]
    (1280, 400, 0)
    """
    from simplexmesh.motion.evolve import mean_edge

    mesh = result.mesh
    return {
        **mesh_numbers(mesh),
        "mean_edge": mean_edge(mesh),
        "before": mesh_numbers(before),
        "diagonal": diagonal(before),
        "rms": result.rms,
        "largest": result.largest,
        "exceptions": len(result.exceptions),
        "problems": list(mesh.check(self_intersections=True).problems),
    }


def diagonal(mesh: Any) -> float:
    """Return the length of the diagonal of the bounding box.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> round(diagonal(sm.plane(4, 4, size=(3.0, 4.0))))
    5
    """
    low, high = mesh.bounds
    return float(((high - low) ** 2).sum() ** 0.5)


def _print(facts: dict[str, Any], output: Path) -> None:
    before = facts["before"]
    pieces = f", {facts['components']} components" if facts["components"] > 1 else ""
    odd = facts["exceptions"]
    table(
        str(output),
        {
            "before": f"{before['vertices']:,} vertices, {before['faces']:,} faces",
            "mesh": f"{facts['vertices']:,} vertices, {facts['faces']:,} faces, genus {facts['genus']}, "
            f"{facts['holes']} holes{pieces}",
            "size": f"area {facts['area']:.6g}, volume {facts['volume']:.6g}, mean edge {facts['mean_edge']:.4g}",
            "distance": f"rms {_part(facts['rms'], facts)}, largest {_part(facts['largest'], facts)}",
            "faces": "of five to seven vertices" + (f", except {odd:,}" if odd else ""),
            "problems": "\n".join(facts["problems"]) or "none",
            "time": f"{facts['seconds']:.1f} s",
        },
    )


def _part(length: float, facts: dict[str, Any]) -> str:
    """Return a length as text, with its share of the diagonal."""
    return f"{length:.4g} ({100 * length / facts['diagonal']:.2g} %)" if facts["diagonal"] else f"{length:.4g}"
