"""`simplexmesh reconstruct`: from a volume, a scan or several to a surface model."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh.cli.report import MODELS, PICTURES, as_json, direction, note, progress, table, writable

EXAMPLE = (
    "Examples: simplexmesh reconstruct head_ct.mhd --level 500 --vertices 3000 -o head.vtp ;  "
    "simplexmesh reconstruct bun000.ply bun045.ply bun090.ply --poses bun.conf -o bunny.vtp"
)


def command(
    inputs: Annotated[
        list[Path], typer.Argument(metavar="INPUT", help="A volume, a surface, points, or several scans.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Model: .vtp (keeps all), .ply, .obj, .off, .stl.")],
    level: Annotated[float | None, typer.Option(help="Value on the surface wanted, for intensities.")] = None,
    label: Annotated[int | None, typer.Option(help="Region wanted, for a volume of labels.")] = None,
    inside: Annotated[str, typer.Option(help="Where the object is: above the level, or below.")] = "above",
    vertices: Annotated[int, typer.Option(help="Number of vertices of the model, kept within 10 %.")] = 4000,
    init: Annotated[
        str, typer.Option(help="Start: auto, sphere, ellipsoid, cylinder, plane, torus, or a .vtp file of a mesh.")
    ] = "auto",
    poses: Annotated[Path | None, typer.Option(help="Where each scan was taken, such as bun.conf.")] = None,
    components: Annotated[str, typer.Option(help="Which pieces to keep: largest or all.")] = "largest",
    tunnels: Annotated[float | None, typer.Option(help="Seal holes through the body narrower than this.")] = None,
    iterations: Annotated[int, typer.Option(help="Most iterations of the fine stage.")] = 300,
    picture: Annotated[Path | None, typer.Option(help="Write a picture of data and model to this file.")] = None,
    view: Annotated[str, typer.Option(help="Side the picture is taken from: iso, xy, -xy, xz, yx, ...")] = "iso",
    json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> int:
    """Fit a surface model to a volume, a label, a scan or several scans."""
    output = writable(output, "--output", MODELS, inputs)
    if picture is not None:
        picture = writable(picture, "--picture", PICTURES, inputs)
    camera = direction(view)

    from simplexmesh.motion.reconstruct import reconstruct

    began = time.perf_counter()
    data = loaded(inputs, poses)
    with progress("reconstructing", wanted=not json) as report:
        result = reconstruct(
            data,
            level=level,
            label=label,
            inside=inside,
            vertices=vertices,
            init=init,
            components=components,
            tunnels=tunnels,
            iterations=iterations,
            progress=report,
        )
    seconds = time.perf_counter() - began
    result.mesh.save(output)
    if result.interrupted:
        note(f"interrupted; the model reached so far is in {output}")
    elif not result.converged:
        note(f"still moving after {len(result.history)} iterations; --iterations allows more")
    if picture is not None:
        _draw(picture, data, result, level, label, camera)
    facts = described(result) | {"seconds": round(seconds, 3), "output": str(output)}
    if json:
        as_json(facts)
    else:
        _print(result, seconds, output)
    return 130 if result.interrupted else 0


def loaded(inputs: list[Path], poses: Path | None) -> Any:
    """Return the data of the files: of one as it is, of several, or one with a pose, as joined points."""
    from simplexmesh.data.convert import as_data
    from simplexmesh.motion.subjects import joined_scans

    if len(inputs) == 1 and poses is None:
        return as_data(inputs[0])
    return joined_scans(inputs, poses)


def described(result: Any) -> dict[str, Any]:
    """Return the numbers that describe a reconstruction."""
    mesh = result.mesh
    return {
        "vertices": mesh.n_vertices,
        "faces": mesh.n_faces,
        "genus": mesh.genus,
        "holes": mesh.n_holes,
        "components": mesh.n_components,
        "area": mesh.area,
        "volume": mesh.volume,
        "distance": {
            "mesh_to_data": asdict(result.distance.mesh_to_data),
            "data_to_mesh": asdict(result.distance.data_to_mesh),
        },
        "iterations": len(result.history),
        "converged": result.converged,
        "interrupted": result.interrupted,
    }


def _draw(path: Path, data: Any, result: Any, level: float | None, label: int | None, camera: str | None) -> None:
    from simplexmesh import plot

    plot.picture(path, plot.beside(data, result.mesh, level=level, label=label, view=camera))


def _print(result: Any, seconds: float, output: Path) -> None:
    mesh, rest = result.mesh, "at rest" if result.converged else "still moving"
    pieces = f", {mesh.n_components} components" if mesh.n_components > 1 else ""
    table(
        str(output),
        {
            "mesh": f"{mesh.n_vertices:,} vertices, {mesh.n_faces:,} faces, genus {mesh.genus}, "
            f"{mesh.n_holes} holes{pieces}",
            "size": f"area {mesh.area:.6g}, volume {mesh.volume:.6g}",
            "mesh to data": _spread(result.distance.mesh_to_data),
            "data to mesh": _spread(result.distance.data_to_mesh),
            "motion": f"{len(result.history)} iterations, {rest}",
            "time": f"{seconds:.1f} s",
        },
    )


def _spread(spread: Any) -> str:
    return f"mean {spread.mean:.4g}, rms {spread.rms:.4g}, 95 % {spread.p95:.4g}, max {spread.max:.4g}"
