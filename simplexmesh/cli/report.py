"""What commands share: options; tables and JSON on standard output; notes, errors and progress on standard error."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh._base.interrupts import Interrupts, deferred_interrupts
from simplexmesh._base.progress import Progress, reporting
from simplexmesh.data.json_text import json_text

PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".html")
INTERRUPTED = 130
KEPT = "interrupted, with the results so far kept"  # return value of such a command
UPS = ("auto", "x", "y", "z", "-x", "-y", "-z")
NOTES: list[str] = []  # the notes printed so far, for JSON
ROWS = 30  # of a table in the report; JSON has all
SAVED = ".vtp (keeps everything), or what else sm.save writes, as .ply, .stl, .glb"
VIEWS = ("iso", "xy", "xz", "yz", "yx", "zx", "zy", "-xy", "-xz", "-yz", "-yx", "-zx", "-zy")

Level = Annotated[float | None, typer.Option(help="Isovalue of an intensity volume.")]
Label = Annotated[int | None, typer.Option(help="Region of a label map.")]
Inside = Annotated[str, typer.Option(help="Whether the object is above or below the level.")]
Model = Annotated[Path, typer.Option("--output", "-o", help=f"Model to write: {SAVED}.")]
View = Annotated[str, typer.Option("--view", help="Direction of view: iso, xy, -xy, xz, yx, ...")]
Picture = Annotated[Path | None, typer.Option("--picture", help="Write a picture to this file.")]
Up = Annotated[str, typer.Option(help="Axis that points up: x, y, z, -x, -y, -z or auto.")]
Unit = Annotated[str, typer.Option(help="Unit of length, for the color scale and the report.")]
Json = Annotated[bool, typer.Option("--json", help="Print the report as JSON.")]


def mesh_numbers(mesh: Any) -> dict[str, Any]:
    """Return the numbers that every command reports of a simplex mesh."""
    names = ("n_vertices", "n_faces", "genus", "n_holes", "n_components", "area", "volume")
    return {name.removeprefix("n_"): getattr(mesh, name) for name in names}


def mesh_rows(facts: Mapping[str, Any]) -> dict[str, str]:
    """Return the rows of a table with these numbers and the mean edge."""
    pieces = f", {facts['components']} components" if facts["components"] > 1 else ""
    counts = f"{facts['vertices']:,} vertices, {facts['faces']:,} faces, genus {facts['genus']}, {facts['holes']} holes"
    size = f"area {facts['area']:.6g}, volume {facts['volume']:.6g}, mean edge {facts['mean_edge']:.4g}"
    return {"mesh": counts + pieces, "size": size}


def note(message: str) -> None:
    """Print a note on standard error, and record it for JSON."""
    NOTES.append(message)
    typer.echo(f"note: {message}", err=True)


def table(title: str, rows: Mapping[str, Any]) -> None:
    """Print names and values as a small table."""
    from rich.console import Console
    from rich.table import Table

    grid = Table(show_header=False, box=None, padding=(0, 0, 0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column(overflow="fold")
    for name, value in rows.items():
        grid.add_row(name, str(value))
    console = Console(file=sys.stdout, highlight=False, markup=False, emoji=False)  # file names are plain text
    console.print(title, style="bold")
    console.print(grid)


def columns(titles: Sequence[str], rows: Sequence[Sequence[str]], rest: str = "more", most: int = ROWS) -> str:
    """Return titled columns of text, those of numbers flush right; of many rows the first, and how many more."""
    aligned = []
    for cells in zip(titles, *rows[:most], strict=True):
        width, numbers = max(map(len, cells)), all(set(cell) <= set("0123456789,.+-e") for cell in cells[1:])
        aligned.append([cell.rjust(width) if numbers else cell.ljust(width) for cell in cells])
    lines = ["  ".join(row).rstrip() for row in zip(*aligned, strict=True)]
    return "\n".join(lines + [f"and {len(rows) - most:,} {rest}, which --json lists"] * (len(rows) > most))


def tell(facts: Mapping[str, Any], title: str, rows: Mapping[str, Any], *, json: bool) -> None:
    """Print a report: its facts and the notes as JSON, or a table."""
    if json:
        as_json({**facts, "notes": NOTES})
    else:
        table(title, rows)


def as_json(facts: Mapping[str, Any]) -> None:
    """Print one JSON object, with non-finite numbers as null."""
    typer.echo(json_text(facts))


@contextmanager
def work(title: str, *, wanted: bool = True) -> Iterator[tuple[Interrupts, Progress]]:
    """Show the progress of a command; a Ctrl-C is raised where it reports some, or checks."""
    with deferred_interrupts() as interrupts, progress(title, wanted=wanted) as shown:
        yield interrupts, interrupts.checking(shown)


@contextmanager
def progress(title: str, *, wanted: bool = True) -> Iterator[Progress]:
    """Yield a progress callback that draws a bar on standard error; without a terminal it does nothing."""
    from simplexmesh._base._kernels_compiled import announce

    announce()
    with reporting(wanted and sys.stderr.isatty(), title, stderr=True) as shown:
        yield shown


def writable(path: Path, option: str, endings: Sequence[str] = (), inputs: list[Path] | None = None) -> Path:
    """Return the path to write to, a model's without `endings`; raise at once, before any long work, if that fails."""
    path, model = path.expanduser(), None
    if not endings:
        from simplexmesh.data.io.writing import FORMATS

        endings, model = tuple(FORMATS), FORMATS.get(path.suffix.lower())
    if path.suffix.lower() not in endings:
        raise ValueError(f"{option} must end with one of {', '.join(endings)}, not {path.suffix or 'nothing'}")
    if model is not None:
        model.needs()
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{option} must be in an existing folder, {str(path.parent)!r} does not exist")
    if not os.access(path.parent, os.W_OK):
        raise PermissionError(f"{option} must be in a writable folder, {str(path.parent)!r} is not")
    if path.is_dir():
        raise IsADirectoryError(f"{option} must be a file, {str(path)!r} is a folder")
    if any(path.exists() and given.exists() and path.samefile(given) for given in inputs or []):
        raise ValueError(f"{option} must not be the input file {str(path)!r}")
    return path


@contextmanager
def written_to(path: Path, what: str) -> Iterator[None]:
    """Make write errors name the path the user gave; print a note when an older file was replaced."""
    older = path.exists()
    try:
        yield
    except OSError as problem:
        if problem.strerror:
            raise OSError(problem.errno, problem.strerror, str(path)) from problem
        raise
    if older:
        note(f"{what} {path} was replaced")


def draw(path: Path | None, plotted: Callable[[Any], Any]) -> None:
    """Write a picture, if one is wanted, of what a function makes with `simplexmesh.plot`."""
    if path is not None:
        with written_to(path, "the picture"):
            from simplexmesh import plot

            plot.picture(path, plotted(plot))


def camera(view: str, up: str, *, drawn: bool = True) -> dict[str, Any]:
    """Return the options of plots that `--view` and `--up` name, which are refused if nothing is drawn."""
    from simplexmesh._base import checks

    checks.choice("--view", view, VIEWS)
    if not drawn and (view, up) != ("iso", "auto"):
        raise ValueError(f"--{'up' if view == 'iso' else 'view'} needs --picture")
    if up != "auto" and view != "iso":
        raise ValueError(f"--up needs the view iso: --view {view} defines its own up axis")
    return {"view": None if view == "iso" else view, "up": checks.choice("--up", up, UPS)}
