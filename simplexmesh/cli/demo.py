"""`simplexmesh demo`: organs of a frog from a labeled volume, one of them also from a noisy scan."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from simplexmesh.cli import report

EXAMPLE = "Example: simplexmesh demo -o demo_output"


def command(
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for models, report and pictures; created if missing.")
    ] = Path("demo_output"),
    size: Annotated[str, typer.Option(help="large (twelve organs) or small (two, coarse).")] = "large",
    json: report.Json = False,
) -> str | None:
    """Reconstruct organs of a frog from a labeled MR volume, and one of them from a noisy scan."""
    from simplexmesh._base import checks
    from simplexmesh.cli import frog

    checks.choice("--size", size, ("large", "small"))
    if output.exists() and not output.is_dir():
        raise NotADirectoryError(f"--output must be a folder, {str(output)!r} is a file")
    parent = next(folder for folder in (output, *output.absolute().parents) if folder.exists())
    if not os.access(parent, os.W_OK):
        raise PermissionError(f"--output must be in a writable folder, {str(parent)!r} is not")
    output.mkdir(parents=True, exist_ok=True)  # before any work, so that it fails at once
    with report.progress("frog", wanted=not json) as reported:
        out = frog.main(size, reported)
    try:
        facts = frog.written(out, output)
    except KeyboardInterrupt:
        report.note(f"interrupted; {output} is incomplete")
        return report.KEPT
    if json:
        report.as_json(facts)
        return None
    rows = {
        name: f"{organ['vertices']:>6,} vertices, genus {organ['genus']}, "
        f"rms to the data {organ['distance']['mesh_to_data']['rms']:.3f}, {organ['seconds']:.1f} s"
        for name, organ in facts["organs"].items()
    }
    scan = facts["scan"]
    rows[f"{scan['of']} from a scan"] = (
        f"{scan['model']['vertices']:>6,} vertices, genus {scan['model']['genus']}, "
        f"mean distance to the truth {scan['mean_distance_to_truth']:.3f}, {scan['model']['seconds']:.1f} s"
    )
    report.table(f"models, report and pictures are in {output}", rows)
    return None
