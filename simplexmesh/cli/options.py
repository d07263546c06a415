"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Level = Annotated[float | None, typer.Option(help="Isovalue of an intensity volume.")]
Label = Annotated[int | None, typer.Option(help="Region of a label map.")]
Inside = Annotated[str, typer.Option(help="Whether the object is above or below the level.")]
Model = Annotated[
    Path, typer.Option("--output", "-o", help="Model to write: .vtp (keeps everything), .ply, .obj, .off, .stl.")
]
View = Annotated[str, typer.Option("--view", help="Direction of view: iso, xy, -xy, xz, yx, ...")]
Unit = Annotated[str, typer.Option(help="Unit of length, for the color scale and the report.")]
Json = Annotated[bool, typer.Option("--json", help="Print the report as JSON.")]
