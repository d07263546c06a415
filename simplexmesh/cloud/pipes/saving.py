"""Files of pipe lines: all that is known of their elements, or a bill of materials."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.drafts import draft

if TYPE_CHECKING:
    from simplexmesh.cloud.pipes.line import PipeElement

COLUMNS = (
    *("line", "element", "kind", "diameter", "end_diameter", "length", "bend_radius", "bend_angle_degrees"),
    *("diameter_deviation", "length_deviation", "bend_radius_deviation", "bend_angle_deviation_degrees"),
)
"""Of the bill of materials."""


def save(lines: Sequence[Sequence[PipeElement]], path: str | os.PathLike[str]) -> None:
    """Write the elements of lines as JSON or as a table, by the ending of the path."""
    file = checks.path("path", path)
    ending = file.suffix.lower()
    if ending not in (".json", ".csv"):
        raise ValueError(f"path must end in .json or .csv, not {file.suffix or file.name!r}")
    text = json.dumps(described(lines), indent=1) if ending == ".json" else bill(lines)
    with draft(file) as part:
        part.write_text(text, encoding="utf-8", newline="")


def described(lines: Sequence[Sequence[PipeElement]]) -> dict[str, Any]:
    """Return what is known of the elements of lines, as JSON has it: angles are in radians."""
    return {"lines": [{"elements": [_element(element) for element in line]} for line in lines]}


def bill(lines: Sequence[Sequence[PipeElement]]) -> str:
    """Return the table of the elements of lines, as CSV: lengths along the axis."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for k, line in enumerate(lines):
        for i, e in enumerate(line):
            sizes = (2 * e.radius, 2 * e.end_radius, e.length, e.bend_radius, _degrees(e.bend_angle))
            d = e.deviations
            spread = d and (2 * d.radius, d.length, d.bend_radius, _degrees(d.bend_angle))
            numbers = (*sizes, *(spread or [None] * 4))
            writer.writerow([k + 1, i + 1, e.kind, *("" if x is None else f"{x:.9g}" for x in numbers)])
    return out.getvalue()


def _degrees(angle: float | None) -> float | None:
    """Return an angle in degrees, if there is one."""
    return None if angle is None else float(np.degrees(angle))


def _element(element: PipeElement) -> dict[str, Any]:
    """Return what is known of an element, as JSON has it."""
    primitive = element.primitive
    parameters = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in vars(primitive).items()
        if isinstance(value, np.ndarray | float) and name != "frame"
    }
    known = element.deviations is not None and primitive.covariance is not None
    covariance = np.asarray(primitive.covariance).tolist() if known else None
    names = ("radius", "end_radius", "bend_radius", "bend_angle", "length")
    return {
        "kind": element.kind,
        "start": element.start.tolist(),
        "end": element.end.tolist(),
        **{name: getattr(element, name) for name in names},
        "deviations": element.deviations and element.deviations._asdict(),
        "primitive": {"kind": primitive.kind, **parameters, "covariance": covariance},
    }
