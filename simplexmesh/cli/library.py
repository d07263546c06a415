"""`simplexmesh library`: keep models in one file, and find which of them a scan shows."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh._base.interrupts import deferred_interrupts
from simplexmesh.cli import report

EXAMPLE = "Example: simplexmesh library recognize models.sml scan.ply"
ADD_EXAMPLE = "Example: simplexmesh library add models.sml cow.obj elephant.off"
LIST_EXAMPLE = "Example: simplexmesh library list models.sml --json"
REMOVE_EXAMPLE = "Example: simplexmesh library remove models.sml cow"
RECOGNIZE_EXAMPLE = "Example: simplexmesh library recognize models.sml scan.ply --picture found.png"

Library = Annotated[Path, typer.Argument(metavar="LIBRARY", help="File of the library, .sml by convention.")]


def add(
    library: Library,
    inputs: Annotated[list[Path], typer.Argument(metavar="FILE", help="Models: surfaces, points, volumes.")],
    name: Annotated[
        str | None, typer.Option(help="Name of the model, for a single file. Default: the file name without suffix.")
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="Replace models with the same names.")] = False,
    level: report.Level = None,
    label: report.Label = None,
    inside: report.Inside = "above",
    json: report.Json = False,
) -> int | str:
    """Add models to a library, which is created if missing. Each is on disk before the next is read."""
    names = _names(inputs, name)
    code: int | str = 0
    added: list[str] = []
    with report.work("adding", wanted=not json and len(inputs) > 1) as (_, reported):
        from simplexmesh.recognition.library.library import ModelLibrary

        models = ModelLibrary(library)
        if not replace and (taken := sorted(set(names) & set(models.names))):
            raise ValueError(f"names must be new to {library} (see --replace); it already has {', '.join(taken)}")
        try:
            for k, (each, path) in enumerate(zip(names, inputs, strict=True)):
                reported(k / len(inputs), path.name)
                _add(models, each, path, replace=replace, level=level, label=label, inside=inside)
                added.append(each)
        except KeyboardInterrupt:
            if not added:
                raise
            report.note("interrupted; models added before are kept")
            code = report.KEPT
        except (ValueError, TypeError, OSError):
            if added:
                report.note(f"models added before are kept: {', '.join(added)}")
            raise
    facts = {"library": library, "added": added, "models": len(models)}
    report.tell(facts, str(library), {"added": ", ".join(added), "models": len(models)}, json=json)
    return code


def _names(inputs: list[Path], name: str | None) -> list[str]:
    """Return the names of the models."""
    if name is None:
        names = [path.stem for path in inputs]
        if twice := [each for each in names if names.count(each) > 1]:
            raise ValueError(f"files must have different names, which the models take; {twice[0]!r} is given twice")
        return names
    if len(inputs) > 1:
        raise ValueError(f"--name needs a single file, not {len(inputs)}")
    return [name]


def _add(models: Any, name: str, path: Path, **options: Any) -> None:
    """Add the model in a file; errors name the file."""
    from simplexmesh.data.io.reading import read

    data = read(path)  # names the file itself
    try:
        models.add(name, data, **options)
    except (ValueError, TypeError) as problem:
        raise ValueError(f"{path}: {str(problem).removeprefix('data: ')}") from None


def _stored(library: Path) -> Any:
    """Return an existing library."""
    from simplexmesh.recognition.library.library import ModelLibrary

    if not library.exists():
        raise FileNotFoundError(f"there is no model library {library}")
    return ModelLibrary(library)


def list_models(library: Library, json: report.Json = False) -> None:
    """List the models of a library, in the order they were added."""
    names = _stored(library).names
    if json:
        report.as_json({"library": library, "models": names})
        return
    for name in names:
        typer.echo(name)


def remove(
    library: Library,
    names: Annotated[list[str], typer.Argument(metavar="NAME", help="Models, named as in `list`.")],
    json: report.Json = False,
) -> None:
    """Remove models from a library."""
    models = _stored(library)
    if absent := sorted(set(names) - set(models.names)):
        raise ValueError(f"names must be those of models in {library}; there is none called {absent[0]!r}")
    removed = list(dict.fromkeys(names))
    with deferred_interrupts():
        for name in removed:
            models.remove(name)
    if json:
        report.as_json({"library": library, "removed": removed, "models": len(models)})
        return
    report.table(str(library), {"removed": ", ".join(removed), "models": len(models)})


def recognize(
    library: Library,
    scan: Annotated[Path, typer.Argument(metavar="SCAN", help="An object, or a part of it, in the models' unit.")],
    best: Annotated[int, typer.Option(help="Largest number of models to report.")] = 5,
    level: report.Level = None,
    label: report.Label = None,
    inside: report.Inside = "above",
    picture: report.Picture = None,
    json: report.Json = False,
) -> None:
    """Find which models a scan shows, best first, and the pose of each."""
    picture = picture and report.writable(picture, "--picture", report.PICTURES, [library, scan])
    if best < 1:
        raise ValueError(f"--best must be at least 1, not {best}")
    with report.work("recognizing", wanted=not json) as (interrupts, reported):
        from simplexmesh.data.io.reading import read

        models, data = _stored(library), read(scan)
        began = time.perf_counter()
        found = models.recognize(data, best=best, level=level, label=label, inside=inside, progress=reported)
        seconds = time.perf_counter() - began
        interrupts.check()
        if found:
            first, surface = found[0], {"level": level, "label": label, "inside": inside}
            titles = (f"the scan, and {first.name} as stored in the library", f"{first.name} in the pose found")
            placed = models.points(first.name), data, first.T_target_source
            report.draw(picture, lambda plot: plot.overlay(*placed, titles=titles, **surface))
    if not found:
        report.note("no model of the library fits")
    each = ("name", "score", "overlap", "error", "T_target_source")
    facts = {"models": [{name: getattr(one, name) for name in each} for one in found], "seconds": round(seconds, 3)}
    rows = {
        f"{place}. {one.name}": f"score {one.score:.2f}, overlap {one.overlap:.0%}, error {one.error:.3g}"
        for place, one in enumerate(found, 1)
    }
    report.tell(facts, scan.name, rows | {"time": f"{seconds:.1f} s"}, json=json)
