"""`simplexmesh library`: models in one file, and which of them a scan shows."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh.cli.interrupt import held_interrupts
from simplexmesh.cli.report import KEPT, NOTES, PICTURES, as_json, note, progress, table, writable, written_to

EXAMPLE = "Example: simplexmesh library recognise models.sml scan.ply"
ADD_EXAMPLE = "Example: simplexmesh library add models.sml cow.obj elephant.off"
LIST_EXAMPLE = "Example: simplexmesh library list models.sml --json"
REMOVE_EXAMPLE = "Example: simplexmesh library remove models.sml cow"
RECOGNISE_EXAMPLE = "Example: simplexmesh library recognise models.sml scan.ply --picture found.png"

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
    inside: Annotated[str, typer.Option(help="Where the object is: above the level, or below.")] = "above",
    json: Json = False,
) -> int | str:
    """Add models to a library, which is made if there is none. Each is on disk before the next is read."""
    names = _names(inputs, name)
    code: int | str = 0
    added: list[str] = []
    with held_interrupts() as interrupts, progress("adding", wanted=not json and len(inputs) > 1) as report:
        from simplexmesh.recognition.library import ModelLibrary

        models, reported = ModelLibrary(library), interrupts.watching(report)
        if not replace and (taken := sorted(set(names) & set(models.names))):
            raise ValueError(f"names must be new to {library}, unless with --replace; it has {', '.join(taken)}")
        try:
            for k, (each, path) in enumerate(zip(names, inputs, strict=True)):
                reported(k / len(inputs), path.name)
                _added(models, each, path, replace=replace, level=level, label=label, inside=inside)
                added.append(each)
        except KeyboardInterrupt:
            if not added:
                raise
            note("interrupted; what was added before is kept")
            code = KEPT
        except (ValueError, TypeError, OSError):
            if added:
                note(f"added before, and kept: {', '.join(added)}")
            raise
    facts = {"library": library, "added": added, "models": len(models)}
    if json:
        as_json(facts | {"notes": NOTES})
        return code
    table(str(library), {"added": ", ".join(added), "models": facts["models"]})
    return code


def _names(inputs: list[Path], name: str | None) -> list[str]:
    """Return what models are to be called."""
    if name is None:
        names = [path.stem for path in inputs]
        if twice := [each for each in names if names.count(each) > 1]:
            raise ValueError(f"files must have different names, as models are called so; {twice[0]!r} is there twice")
        return names
    if len(inputs) > 1:
        raise ValueError(f"--name is for one file, not {len(inputs)}")
    return [name]


def _added(models: Any, name: str, path: Path, **options: Any) -> None:
    """Add the model in a file; what is wrong with it is told with the file's name."""
    from simplexmesh.data.reading import read

    data = read(path)  # names the file itself
    try:
        models.add(name, data, **options)
    except (ValueError, TypeError) as problem:
        raise ValueError(f"{path}: {str(problem).removeprefix('data: ')}") from None


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


def remove(
    library: Library,
    names: Annotated[list[str], typer.Argument(metavar="NAME", help="Models, as `list` tells them.")],
    json: Json = False,
) -> None:
    """Take models out of a library."""
    from simplexmesh.recognition.library import ModelLibrary

    if not library.exists():
        raise FileNotFoundError(f"there is no model library {library}")
    models = ModelLibrary(library)
    if absent := sorted(set(names) - set(models.names)):
        raise ValueError(f"names must be those of models in {library}; there is none called {absent[0]!r}")
    removed = list(dict.fromkeys(names))
    with held_interrupts():
        for name in removed:
            models.remove(name)
    if json:
        as_json({"library": library, "removed": removed, "models": len(models)})
        return
    table(str(library), {"removed": ", ".join(removed), "models": len(models)})


def recognise(
    library: Library,
    scan: Annotated[Path, typer.Argument(metavar="SCAN", help="An object, or a part of it, in the models' unit.")],
    best: Annotated[int, typer.Option(help="How many models to tell at most.")] = 5,
    level: Annotated[float | None, typer.Option(help="Surface meant, of volumes of intensities.")] = None,
    label: Annotated[int | None, typer.Option(help="Region meant, of volumes of labels.")] = None,
    inside: Annotated[str, typer.Option(help="Where the object is: above the level, or below.")] = "above",
    picture: Annotated[Path | None, typer.Option(help="Write a picture of the scan with the best model in it.")] = None,
    json: Json = False,
) -> None:
    """Say which models a scan may be of, best first, and where each lies in it."""
    if picture is not None:
        picture = writable(picture, "--picture", PICTURES, [library, scan])
    if best < 1:
        raise ValueError(f"--best must be at least 1, not {best}")
    if not library.exists():
        raise FileNotFoundError(f"there is no model library {library}")
    with held_interrupts() as interrupts, progress("recognizing", wanted=not json) as report:
        from simplexmesh.data.reading import read
        from simplexmesh.recognition.library import ModelLibrary

        models, data = ModelLibrary(library), read(scan)
        began = time.perf_counter()
        told = interrupts.watching(report)
        found = models.recognise(data, best=best, level=level, label=label, inside=inside, progress=told)
        seconds = time.perf_counter() - began
        interrupts.check()
        if picture is not None and found:
            with written_to(picture, "the picture"):
                _draw(picture, data, models, found[0], level, label)
    if not found:
        note("no model of the library fits")
    if json:
        each = ("name", "score", "overlap", "error", "T_scan_model")
        listed = [{name: getattr(one, name) for name in each} for one in found]
        as_json({"models": listed, "seconds": round(seconds, 3), "notes": NOTES})
        return
    table(
        scan.name,
        {
            f"{place}. {one.name}": f"score {one.score:.2f}, overlap {one.overlap:.0%}, error {one.error:.3g}"
            for place, one in enumerate(found, 1)
        }
        | {"time": f"{seconds:.1f} s"},
    )


def _draw(path: Path, scan: Any, models: Any, best: Any, level: float | None, label: int | None) -> None:
    """Write a picture of the best model and the scan, and of the model where it was found."""
    from simplexmesh import plot

    titles = (f"the scan, and {best.name} as it is in the library", f"{best.name} where it was found")
    model, T = models.points(best.name), best.T_scan_model
    plot.picture(path, plot.overlay(model, scan, T, level=level, label=label, titles=titles))
