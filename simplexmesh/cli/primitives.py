"""`simplexmesh primitives` and `simplexmesh pipes`: what a scan of a plant or a part is made of."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh.cli import report

EXAMPLE = "Example: simplexmesh primitives scan.ply -o shapes.json --mesh shapes.vtp --picture shapes.png"
EXAMPLE_PIPES = "Example: simplexmesh pipes scan.laz -o pipes.json --step pipes.step --table pipes.csv"
KINDS = "plane,sphere,cylinder,cone,torus"

PointsPath = Annotated[Path, typer.Argument(metavar="INPUT", help="Points: .ply, .xyz, .pcd, .las, .laz, .e57, ...")]
Output = Annotated[Path | None, typer.Option("--output", "-o", help="File to write: .json, with all parameters.")]
Mesh = Annotated[Path | None, typer.Option("--mesh", help=f"Write the surfaces: {report.SAVED}.")]
Step = Annotated[Path | None, typer.Option("--step", help="Write exact surfaces, or solids of pipes: .step, .stp.")]
Labeled = Annotated[
    Path | None,
    typer.Option("--labeled", "--labelled", help="Write all points with their labels: .laz, .las, .e57, .ply, .vtp."),
]
PointsUnit = Annotated[str | None, typer.Option(help="Unit of the points, where the file does not say: m, mm, ...")]
STEPS, CLOUDS = (".step", ".stp"), (".laz", ".las", ".e57", ".ply", ".vtp")


def primitives(
    path: PointsPath,
    output: Output = None,
    kinds: Annotated[str, typer.Option(help="Kinds to look for, separated by commas.")] = KINDS,
    noise: Annotated[float | None, typer.Option(help="Deviation of the points, in the file's unit; else seen.")] = None,
    mesh: Mesh = None,
    step: Step = None,
    labeled: Labeled = None,
    unit: PointsUnit = None,
    picture: report.Picture = None,
    side: report.View = "iso",
    up: report.Up = "auto",
    json: report.Json = False,
) -> int:
    """Find the planes, spheres, cylinders, cones and tori that points are on."""
    files = {"--output": (output, (".json",)), "--mesh": (mesh, ())}
    targets = _targets(path, files | {"--step": (step, STEPS), "--labeled": (labeled, CLOUDS)}, picture)
    camera = _camera(side, up, picture)
    with report.work("primitives", wanted=not json) as (interrupts, reported):
        from simplexmesh.cloud.extraction.extract import extract_primitives

        began, cloud = time.perf_counter(), _read(path, unit, targets, reported)
        asked = tuple(word.strip() for word in kinds.split(","))
        scene = extract_primitives(cloud, kinds=asked, noise=noise, progress=reported)
        facts = _counts(scene, began) | {name: told for name, told in scene.as_dict().items() if name != "labels"}
        sizes = [len(scene.points(k)) for k in range(len(scene))]
        interrupts.check()
        _write(scene, targets, cloud.with_data(label=scene.labels))
        report.draw(picture, lambda plot: plot.primitives(cloud, scene, title=path.name, **camera))
    told = zip(facts["primitives"], sizes, strict=True)
    rows = [[each["kind"], _sizes(each), f"{each['fit']['rms']:.3g}", f"{count:,}"] for each, count in told]
    report.tell(facts, str(path), _rows(facts, "primitives", ("kind", "size", "rms", "points"), rows), json=json)
    return 0


def pipes(
    path: PointsPath,
    output: Output = None,
    bill: Annotated[Path | None, typer.Option("--table", help="Write a bill of materials: .csv.")] = None,
    pick: Annotated[str | None, typer.Option(help="Only the pipe at this point: x,y,z.")] = None,
    radius: Annotated[float | None, typer.Option(help="Radius of the pipes, in the file's unit, if known.")] = None,
    mesh: Mesh = None,
    step: Step = None,
    labeled: Labeled = None,
    unit: PointsUnit = None,
    picture: report.Picture = None,
    side: report.View = "iso",
    up: report.Up = "auto",
    json: report.Json = False,
) -> int:
    """Find pipe lines: straight parts, bends, reducers and tees, in order and tangent to one another."""
    files = {"--output": (output, (".json",)), "--table": (bill, (".csv",)), "--mesh": (mesh, ())}
    targets = _targets(path, files | {"--step": (step, STEPS), "--labeled": (labeled, CLOUDS)}, picture)
    camera = _camera(side, up, picture)
    at = None if pick is None else _place(pick)
    with report.work("pipes", wanted=not json) as (interrupts, reported):
        from simplexmesh.cloud.pipes.follow import follow_pipe
        from simplexmesh.cloud.pipes.plant import extract_pipes

        began, cloud = time.perf_counter(), _read(path, unit, targets, reported)
        if at is None:
            found: Any = extract_pipes(cloud, radius=radius, progress=reported)
        else:
            reported(0.1, "following the pipe")
            found = follow_pipe(cloud, at, radius=radius)
        facts = _counts(found, began) | found.as_dict()
        interrupts.check()
        _write(found, targets, cloud.with_data(**_labels(found)))
        report.draw(picture, lambda plot: plot.primitives(cloud, found, title=path.name, **camera))
    rows = [[str(k + 1), *_element(each)] for k, line in enumerate(facts["lines"]) for each in line["elements"]]
    rows += [["", *_element(each)] for each in facts["tees"]]
    columns = ("line", "kind", "diameter", "length", "bend")
    report.tell(facts, str(path), _rows(facts, "elements", columns, rows), json=json)
    return 0


def _camera(side: str, up: str, picture: Path | None) -> dict[str, Any]:
    """Return how to look at a plant, which stands upright unless something else is said."""
    camera = report.camera(side, up, drawn=picture is not None)
    return camera | {"up": "z" if up == "auto" else up}


def _targets(
    path: Path, files: dict[str, tuple[Path | None, tuple[str, ...]]], picture: Path | None
) -> dict[str, Path]:
    """Return the files to write by their options, checked, and check the picture's."""
    if picture is not None:
        report.writable(picture, "--picture", report.PICTURES, [path])
    out = {name: report.writable(file, name, endings, [path]) for name, (file, endings) in files.items() if file}
    if len(set(out.values())) < len(out):
        raise ValueError(f"{' and '.join(out)} must be different files")
    return out


def _read(path: Path, unit: str | None, targets: dict[str, Path], reported: Any) -> Any:
    """Return the points of a file, in the unit that it or else the user says."""
    from simplexmesh.data.io.reading import read_points

    if "--step" in targets:
        from simplexmesh.cloud.step import needed

        needed()
    reported(0.0, "reading")
    cloud = read_points(path)
    if unit is not None and cloud.unit not in (None, unit):
        raise ValueError(f"--unit must be {cloud.unit}, as {path.name} says, or left out, not {unit}")
    return cloud if unit is None else cloud.in_unit(unit, unit)


def _labels(found: Any) -> dict[str, Any]:
    """Return the line of each point, and its element in that line, -1 for none."""
    import numpy as np

    if not hasattr(found, "lines"):
        return {"line": np.where(found.labels < 0, -1, 0), "element": found.labels}
    element = np.full(len(found.labels), -1)
    for k, line in enumerate(found.lines):
        element = np.where(found.labels == k, line.labels, element)
    return {"line": found.labels, "element": element}


def _counts(found: Any, began: float) -> dict[str, Any]:
    """Return what reports of both commands begin with."""
    seconds = round(time.perf_counter() - began, 3)
    return {"points": len(found.labels), "left_over": int((found.labels < 0).sum()), "seconds": seconds}


def _place(text: str) -> list[float]:
    """Return the coordinates that a text tells."""
    try:
        place = [float(word) for word in text.split(",")]
    except ValueError:
        place = []
    if len(place) != 3:
        raise ValueError(f"--pick must be three numbers separated by commas, x,y,z, not {text!r}")
    return place


def _write(found: Any, targets: dict[str, Path], labeled: Any) -> None:
    """Write what was found: parameters, a table, surfaces, and the points with their labels."""
    surface = found.to_pyvista() if "--mesh" in targets else None
    if surface is not None and not surface.n_cells:
        raise ValueError("nothing was found of which --mesh could write the surface")
    for option, target in targets.items():
        with report.written_to(target, "the file"):
            (labeled if option == "--labeled" else found).save(target)


def _sizes(shape: dict[str, Any]) -> str:
    """Return the measures of a primitive."""
    told = [f"{name.replace('_', ' ')} {shape[name]:.4g}" for name in ("radius", "tube_radius") if name in shape]
    if "half_angle" in shape:
        told.append(f"half angle {math.degrees(shape['half_angle']):.3g} degrees")
    return ", ".join(told)


def _element(element: dict[str, Any]) -> list[str]:
    """Return the cells of an element of a pipe."""
    bend = ""
    if element["bend_angle"] is not None:
        bend = f"{math.degrees(element['bend_angle']):.1f} degrees on radius {element['bend_radius']:.4g}"
    return [element["kind"], f"{2 * element['radius']:.4g}", f"{element['length']:.4g}", bend]


def _rows(facts: dict[str, Any], name: str, columns: Sequence[str], rows: list[list[str]]) -> dict[str, str]:
    """Return the rows of the report's table, one of which is a table of shapes."""
    return {
        "points": f"{facts['points']:,}, {facts['left_over']:,} of them on none",
        name: f"{len(rows):,}" + ("\n" + report.columns(columns, rows) if rows else ""),
        "time": f"{facts['seconds']:.1f} s",
    }
