"""`simplexmesh view`: show a file in a window, or write a picture where there is no display."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh._base.interrupts import deferred_interrupts
from simplexmesh.cli import report

EXAMPLE = "Example: simplexmesh view head.vtp --scalars mean_curvature"


def command(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="A model, a surface, points or a volume.")],
    scalars: Annotated[
        str | None,
        typer.Option(help="Color by mean_curvature, simplex_angle, distance or deviation (with --data), or an array."),
    ] = None,
    data: Annotated[
        Path | None, typer.Option(help="Data to show beside the model, and to measure distances to.")
    ] = None,
    level: report.Level = None,
    label: report.Label = None,
    inside: report.Inside = "above",
    unit: report.Unit = "",
    side: report.View = "iso",
    up: Annotated[
        str,
        typer.Option(help="Axis that points up: x, y, z, -x, -y, -z, or auto: z, or y for scans taller along y."),
    ] = "auto",
    picture: Annotated[Path | None, typer.Option(help="Write a picture to this file and open no window.")] = None,
) -> None:
    """Show a file in a window; without a display, write a picture to the current folder."""
    picture = picture and report.writable(picture, "--picture", report.PICTURES, [path, *([data] if data else [])])
    camera = report.camera(side, up)

    with deferred_interrupts() as interrupts:
        from simplexmesh import plot
        from simplexmesh.data.conversion import as_data
        from simplexmesh.plot.stage import fit_screen

        shown: Any = as_data(path)
        options = {"scalars": scalars, "level": level, "label": label, "inside": inside, "unit": unit} | camera
        if data is None:
            plotter = plot.surface(shown, title=path.name, **options)
        else:
            plotter = plot.beside(as_data(data), shown, **options)
        interrupts.check()
        windowless = picture is None and not plot.has_display()
        if windowless:
            names = (Path(f"{path.name}{'' if k == 1 else f'-{k}'}.png") for k in count(1))
            unused = next(name for name in names if not name.exists())
            picture = report.writable(unused, "the picture", report.PICTURES)
        if picture is not None:
            with report.written_to(picture, "the picture"):
                plot.picture(picture, plotter)
    if picture is None:
        fit_screen(plotter)
        plotter.show(title=f"simplexmesh: {path.name}")
        return
    if windowless:
        report.note(f"there is no display; the picture was written to {picture}")
    typer.echo(picture)
