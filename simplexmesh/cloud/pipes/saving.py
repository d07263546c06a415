"""Files of pipe lines: all that is known of their elements, a bill of materials, or solids."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from simplexmesh._base.drafts import draft
from simplexmesh.cloud import step
from simplexmesh.data.json_text import json_text
from simplexmesh.data.primitives import Primitive

if TYPE_CHECKING:
    from simplexmesh.cloud.pipes.line import PipeElement, PipeLine

COLUMNS = (
    *("line", "element", "kind", "diameter", "end_diameter", "length", "bend_radius", "bend_angle_degrees"),
    *("diameter_deviation", "length_deviation", "bend_radius_deviation", "bend_angle_deviation_degrees"),
    *("offset", "offset_deviation"),
)
"""Of the bill of materials."""

ENDINGS = (".json", ".csv", *step.ENDINGS)
"""Of files of elements; those of meshes have the tubes."""


def save(lines: Sequence[PipeLine], tees: Sequence[PipeElement], unit: str | None, path: Path) -> None:
    """Write lines and the tees between them as JSON, as a table or as solids, by the ending of the path."""
    ending = path.suffix.lower()
    with draft(path) as place:
        if ending == ".json":
            place.write_text(json_text(described(lines, tees, unit)) + "\n", encoding="utf-8")
        elif ending == ".csv":
            place.write_text(bill(lines, tees), encoding="utf-8", newline="")
        else:
            place.write_bytes(step.step_file(_named(lines, tees), unit, solid=True))


def described(lines: Sequence[PipeLine], tees: Sequence[PipeElement], unit: str | None) -> dict[str, Any]:
    """Return what is known of lines, as plain values: angles are in radians."""
    return {
        "unit": unit,
        "lines": [
            {
                "length": line.length,
                "rms": line.rms,
                "stops": list(line.stops),
                "elements": [_element(each) for each in line.elements],
            }
            for line in lines
        ],
        "tees": [_element(each) for each in tees],
    }


def bill(lines: Sequence[PipeLine], tees: Sequence[PipeElement]) -> str:
    """Return the table of the elements of lines, as CSV: lengths along the axis; tees are of no line."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    numbered = [(str(k + 1), i + 1, each) for k, line in enumerate(lines) for i, each in enumerate(line.elements)]
    for number, i, e in numbered + [("", i + 1, tee) for i, tee in enumerate(tees)]:
        sizes = (2 * e.radius, 2 * e.end_radius, e.length, e.bend_radius, _degrees(e.bend_angle))
        d = e.deviations
        spread = (None,) * 4 if d is None else (2 * d.radius, d.length, d.bend_radius, _degrees(d.bend_angle))
        offset = (e.offset or None, d and d.offset)
        writer.writerow([number, i, e.kind, *("" if x is None else f"{x:.9g}" for x in (*sizes, *spread, *offset))])
    return out.getvalue()


def _degrees(angle: float | None) -> float | None:
    """Return an angle in degrees, if there is one."""
    return None if angle is None else float(np.degrees(angle))


def _named(lines: Sequence[PipeLine], tees: Sequence[PipeElement]) -> dict[str, list[tuple[str, Primitive]]]:
    """Return the primitives of lines and tees, with the names and numbers of the table."""
    groups = {f"line {k + 1}": line.elements for k, line in enumerate(lines)} | {"tees": tuple(tees)}
    return {
        name: [(f"{each.kind} {i + 1}", each.primitive) for i, each in enumerate(group)]
        for name, group in groups.items()
    }


def _element(element: PipeElement) -> dict[str, Any]:
    """Return what is known of an element, as plain values."""
    primitive, fit = element.primitive, element.primitive.fit
    names = ("radius", "end_radius", "bend_radius", "bend_angle", "length", "offset")
    known = element.deviations is not None and primitive.covariance is not None
    covariance = np.asarray(primitive.covariance).tolist() if known else None
    return {
        "kind": element.kind,
        "start": element.start.tolist(),
        "end": element.end.tolist(),
        **{name: getattr(element, name) for name in names},
        "deviations": element.deviations and element.deviations._asdict(),
        "rms": fit.rms if fit else None,
        "points": fit.count if fit else 0,
        "primitive": primitive.as_dict() | {"covariance": covariance},
    }
