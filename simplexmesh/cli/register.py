"""`simplexmesh register`: rigid registration of one object, or a part of it, to another."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh.cli import report

EXAMPLE = "Example: simplexmesh register bun045.ply bun000.ply -o pose.json --picture before_after.png"


def command(
    source: Annotated[
        Path, typer.Argument(metavar="SOURCE", help="The object to be moved: a scan, a surface, a volume.")
    ],
    target: Annotated[Path, typer.Argument(metavar="TARGET", help="The object it is registered to.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File for the pose, .json, as --poses reads it.")
    ] = None,
    level: report.Level = None,
    label: report.Label = None,
    inside: report.Inside = "above",
    picture: report.Picture = None,
    json: report.Json = False,
) -> None:
    """Find the rigid motion between two objects, without an initial guess or a scale parameter."""
    output = output and report.writable(output, "--output", (".json",), [source, target])
    picture = picture and report.writable(picture, "--picture", report.PICTURES, [source, target])
    with report.work("registering", wanted=not json) as (interrupts, reported):
        from simplexmesh.data.io.reading import read
        from simplexmesh.data.poses import write_poses
        from simplexmesh.recognition.register.register import register

        began = time.perf_counter()
        here, there = read(source), read(target)
        surface: dict[str, Any] = {"level": level, "label": label, "inside": inside}
        found = register(here, there, **surface, progress=reported)
        seconds = time.perf_counter() - began
        interrupts.check()
        if output is not None:
            with report.written_to(output, "the pose"):
                write_poses(output, {source.name: found.T_target_source})
        report.draw(picture, lambda plot: plot.overlay(here, there, found.T_target_source, **surface))
    if found.ambiguous:
        report.note("the pose is ambiguous: the objects, or their common part, are symmetric")
    rows = {
        "T_target_source": "\n".join(" ".join(f"{x: .6g}" for x in row) for row in found.T_target_source),
        "error": f"{found.error:.4g}",
        "overlap": f"{found.overlap:.0%} of the source",
        "score": f"{found.score:.2f}",
        "ambiguous": "yes" if found.ambiguous else "no",
        "time": f"{seconds:.1f} s",
    }
    report.tell(_facts(found, seconds), f"{source.name} on {target.name}", rows, json=json)


def _facts(found: Any, seconds: float) -> dict[str, Any]:
    """Return the report of a registration."""
    named = ("T_target_source", "error", "overlap", "score", "ambiguous", "open_motions", "covariance")
    each = ("T_target_source", "score", "overlap", "equivalent")
    poses = [{name: getattr(pose, name) for name in each} for pose in found.poses]
    return {name: getattr(found, name) for name in named} | {"poses": poses, "seconds": round(seconds, 3)}
