"""`simplexmesh library`: models in one file, and which of them a scan shows."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh.cli.report import KEPT, NOTES, PICTURES, as_json, note, progress, table, writable, written_to

EXAMPLE = "Example: simplexmesh library recognise models.sml scan.ply"
ADD_EXAMPLE = "Example: simplexmesh library add models.sml cow.obj elephant.off"
LIST_EXAMPLE = "Example: simplexmesh library list models.sml --json"
RECOGNISE_EXAMPLE = "Example: simplexmesh library recognise models.sml scan.ply --picture found.png"
COLORS = ("#c8553d", "#2a6f97")
MOST_DRAWN = 20_000

Library = Annotated[Path, typer.Argument(metavar="LIBRARY", help="The library's file, .sml by convention.")]
Json = Annotated[bool, typer.Option("--json", help="Print the report as JSON.")]


def add(
    library: Library,
    inputs: Annotated[list[Path], typer.Argument(metavar="FILE", help="Models: surfaces, points, volumes.")],
    name: Annotated[
        str | None, typer.Option(help="The name, for one file. Default: the file's, without ending.")
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="Let models of these names give way.")] = False,
    level: Annotated[float | None, typer.Option(help="Surface meant, of volumes of intensities.")] = None,
    label: Annotated[int | None, typer.Option(help="Region meant, of volumes of labels.")] = None,
    json: Json = False,
) -> int | str:
    """Add models to a library, which is made if there is none. Each is on disk before the next is read."""
    if name is not None and len(inputs) > 1:
        raise ValueError(f"--name is for one file, not {len(inputs)}")
    from simplexmesh.data.reading import read
    from simplexmesh.recognition.library import ModelLibrary

    code: int | str = 0
    models, added = ModelLibrary(library), []
    with progress("adding", wanted=not json and len(inputs) > 1) as report:
        try:
            for k, path in enumerate(inputs):
                report(k / len(inputs), path.name)
                models.add(name or path.stem, read(path), replace=replace, level=level, label=label)
                added.append(name or path.stem)
        except KeyboardInterrupt:
            if not added:
                raise
            note("interrupted; what was added before is kept")
            code = KEPT
    facts = {"library": library, "added": added, "models": len(models)}
    if json:
        as_json(facts | {"notes": NOTES})
        return code
    table(str(library), {"added": ", ".join(added), "models": facts["models"]})
    return code


def list_models(library: Library, json: Json = False) -> None:
    """List the models of a library, in the order in which they were added."""
    from simplexmesh.recognition.library import ModelLibrary

    if not library.exists():
        raise FileNotFoundError(f"there is no model library {library}")
    names = ModelLibrary(library).names
    if json:
        as_json({"library": library, "models": names})
        return
    for name in names:
        typer.echo(name)


def recognise(
    library: Library,
    scan: Annotated[Path, typer.Argument(metavar="SCAN", help="An object, or a part of it, in the models' unit.")],
    best: Annotated[int, typer.Option(min=1, help="How many models to tell at most.")] = 5,
    level: Annotated[float | None, typer.Option(help="Surface meant, of volumes of intensities.")] = None,
    label: Annotated[int | None, typer.Option(help="Region meant, of volumes of labels.")] = None,
    picture: Annotated[Path | None, typer.Option(help="Write a picture of the scan with the best model in it.")] = None,
    json: Json = False,
) -> None:
    """Say which models a scan may be of, best first, and where each lies in it."""
    if picture is not None:
        picture = writable(picture, "--picture", PICTURES, [library, scan])
    with progress("recognizing", wanted=not json) as report:
        from simplexmesh.data.reading import read
        from simplexmesh.recognition.library import ModelLibrary

        data, models = read(scan), ModelLibrary(library)
        began = time.perf_counter()
        found = models.recognise(data, best=best, level=level, label=label, progress=report)
        seconds = time.perf_counter() - began
        if picture is not None and found:
            with written_to(picture, "the picture"):
                _draw(picture, data, models.points(found[0].name), found[0].T_scan_model, level, label)
    if not found:
        note("no model of the library fits")
    if json:
        each = ("name", "score", "overlap", "error", "T_scan_model")
        listed = [{name: getattr(one, name) for name in each} for one in found]
        as_json({"models": listed, "seconds": round(seconds, 3), "notes": NOTES})
        return
    table(
        scan.name,
        {one.name: f"score {one.score:.2f}, overlap {one.overlap:.0%}, error {one.error:.3g}" for one in found}
        | {"time": f"{seconds:.1f} s"},
    )


def _draw(path: Path, scan: Any, model: Any, T: Any, level: float | None, label: int | None) -> None:
    """Write a picture of a scan by itself, and with a model where it was found."""
    from simplexmesh import plot
    from simplexmesh.recognition.surfaces import surface_of

    points = surface_of(scan, "data", level=level, label=label, most=MOST_DRAWN).points
    placed = model.points @ T[:3, :3].T + T[:3, 3]
    plotter = plot.stage(2)
    for column, shown in enumerate(((points,), (points, placed))):
        plotter.subplot(0, column)
        for place, color in zip(shown, COLORS, strict=False):
            plotter.add_points(place, color=color, point_size=4, render_points_as_spheres=True)
        plotter.add_text("with the best model" if column else "the scan", font_size=12, color="#1d2b36")
        plotter.reset_camera()
    plot.picture(path, plotter)
