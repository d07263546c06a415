"""The page of a report: ratings, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

import simplexmesh
from simplexmesh.bench.tables import Rows, as_markdown, formatted, pivoted
from simplexmesh.bench.trials import meshes, ratings
from simplexmesh.bench.trials.curve import Curve
from simplexmesh.bench.trials.published import CRITERIA, OTHERS, THESIS

if TYPE_CHECKING:
    from simplexmesh.bench.run import Results


KINDS = {"curvature": "Curvatures", "normals": "Normals"}
NUMBERS = ("method", "at a point", "on meshes", "worst on a mesh", "right limits", "converge", "order", "spread")
QUANTITIES = {"H": "H", "K": "K", "N": "The normal, |N - truth|"}
ON_TORI = {"H": "Relative error of H", "K": "Relative error of K", "N": "Mean angle of normals in degrees"}
ROUNDED = 1e-9
"""Errors below this are rounding: no order is fitted to them."""


def index(found: Results, pictures: Mapping[str, str], *, quick: bool) -> str:
    """Return the page in Markdown; `pictures` are captions by the name of the file."""
    sections = {
        "# Estimators of normals and curvatures compared": [
            "All methods of `simplexmesh.curvature` and `simplexmesh.vertex_normals` on surfaces with known normals "
            "and curvatures, after the comparison in Charton's thesis (2014) and the article of 2012. "
            f"simplexmesh {simplexmesh.__version__}{', quick run' if quick else ''}."
        ],
        "## Ratings": [
            "From best to worst `+++ ++ + +/- - -- ---`, the thesis's where they differ in brackets, by these rules:",
            ratings.RULES,
            *(part for kind in KINDS if found.ratings[kind] for part in _ratings(kind, found.ratings[kind])),
        ],
        "## One point, neighbors at decreasing distances": [
            "Five patterns of 6 and 12 neighbors around the origin, at 0.5 to 0.0005; curvatures with the exact "
            "normal. Shares of the cases, and the median order. All cases: [pointwise.csv](pointwise.csv); differences "
            "between patterns at equal distance: [spread.csv](spread.csv).",
            as_markdown(_summaries([*found.curves["curvature"], *found.curves["normals"]])),
            *_images(pictures, "pointwise_"),
        ],
        "## Whole meshes": [
            "Mean and largest error over inner vertices, with exact initial normals for curvatures, at size "
            f"{ratings.SIZE}; all sizes: [meshes.csv](meshes.csv). H and K have units, 1 / length and its square.",
            *_meshes(found.meshes),
        ],
        "## Tilted initial normals": [
            "Median error over surfaces and patterns, neighbors at 0.1, when the initial normal is tilted by an angle "
            "in degrees. Of H in units of the largest curvature. Also in [tilts.csv](tilts.csv).",
            *_by_quantity(QUANTITIES, lambda quantity: tilts(found.tilts, quantity)),
        ],
        "## Tori, with other programs": [
            "Relative L2 error of each method with its defaults, and with three rings if it takes any neighborhood: "
            "torus of radius 1 and tube 0.35, regular or with vertices moved on the surface and quads split at random; "
            "normal noise in every coordinate. In brackets the share of vertices without an estimate, which are left "
            "out. With failures and times: [tori.csv](tori.csv).",
            *_by_quantity(ON_TORI, lambda quantity: tori(found.tori, quantity)),
            "Microseconds per vertex, the least over these meshes:",
            as_markdown(_times(found.tori)),
        ],
        "## Borders": [
            "Relative error of H on half an irregular torus of 10k, inside / at the border, with noise in mean edges; "
            "`none` where a method has no estimate at the border. Also in [border.csv](border.csv).",
            borders(found.border),
        ],
        "## Surfaces in color": _images(pictures, "map_"),
    }
    return "\n\n".join(part for title, parts in sections.items() for part in (title, *parts)) + "\n"


def _ratings(kind: str, rows: Rows) -> list[str]:
    return [
        f"### {KINDS[kind]}",
        rating_table(kind, rows),
        "The numbers they are based on:",
        as_markdown(rows, NUMBERS),
    ]


def rating_table(kind: str, rows: Rows) -> str:
    """Return our ratings and, where the thesis has other ones, those in brackets."""
    lines = []
    for row in rows:
        cells = {name: formatted(row[name]) for name in CRITERIA}
        for name, theirs in zip(CRITERIA, THESIS[kind].get(row["method"], ()), strict=False):
            if row[name] not in ("", theirs):
                cells[name] += f" (thesis {formatted(theirs)})"
        lines.append({"method": row["method"], **cells})
    return as_markdown(lines)


def _summaries(curves: Sequence[Curve]) -> Rows:
    flags = {"monotone": "monotone", "has limit": "has_limit", "right limit": "limit_is_correct", "exact": "exact"}
    out = []
    for name, quantity in dict.fromkeys((c.method, c.quantity) for c in curves):
        mine = [c for c in curves if (c.method, c.quantity) == (name, quantity)]
        shares = {label: float(np.mean([getattr(c, flag) for c in mine])) for label, flag in flags.items()}
        orders = [c.order for c in mine if np.isfinite(c.order)]
        order = float(np.median(orders)) if orders else None
        out.append({"method": name, "quantity": quantity, **shares, "order": order})
    return out


def _by_quantity(titles: Mapping[str, str], table: Any) -> list[str]:
    return [part for quantity, title in titles.items() if (text := table(quantity)) for part in (f"{title}:", text)]


def _meshes(rows: Rows) -> list[str]:
    parts = []
    for quantity, label in QUANTITIES.items():
        every = [
            line | {"place": f"{line['surface']} {line['mesh']}".replace("_", " ")}
            for line in rows
            if line["quantity"] == quantity
        ]
        if shown := [line for line in every if line["size"] == ratings.SIZE]:
            errors = as_markdown(pivoted(shown, "place", "method", _mean_and_max))
            parts += [f"{label}:", errors, "Order of the mean error:", as_markdown(orders(every))]
    return parts


def _mean_and_max(line: dict[str, Any]) -> str:
    return " / ".join(f"{line[name]:.1e}" for name in ("mean error", "max error"))


def orders(rows: Rows) -> list[dict[str, Any]]:
    """Return the orders of mean errors, fitted to the finest four sizes, one row per "place"; None at rounding."""
    out: dict[str, dict[str, Any]] = {}
    for place, method in dict.fromkeys((line["place"], line["method"]) for line in rows):
        mine = [line for line in rows if (line["place"], line["method"]) == (place, method)][-4:]
        sizes, errors = (np.array([line[name] for line in mine], float) for name in ("size", "mean error"))
        fits = len(mine) >= 3 and (errors > ROUNDED).all()
        order = f"{-np.polyfit(np.log(sizes), np.log(errors), 1)[0]:.1f}" if fits else None
        out.setdefault(place, {"place": place})[method] = order
    return list(out.values())


def tilts(rows: Rows, quantity: str) -> str:
    """Return the errors of a quantity by the tilt of the initial normal, empty if there are none."""
    lines = [line for line in rows if line["quantity"] == quantity]
    return as_markdown(pivoted(lines, "method", "degrees", "error")) if lines else ""


def tori(rows: Rows, quantity: str) -> str:
    """Return the errors of a quantity on tori, of H also other programs', empty if there are none."""
    lines = [line for line in rows if line["quantity"] == quantity]
    if not lines:
        return ""
    table = pivoted(lines, "method", "case", lambda line: _partly(line["error"], line["failed"] / line["vertices"]))
    if quantity == "H":
        titles = [case.title for case in meshes.CASES]
        table += [
            {"method": f"*{name}*"} | dict(zip(titles, map(float, v), strict=False)) for name, v in OTHERS.items()
        ]
    return as_markdown(table)


def _times(rows: Rows) -> Rows:
    least: dict[str, float] = {}
    for line in rows:
        name = f"{line['method']} (normals)" if line["quantity"] == "N" else line["method"]
        least[name] = min(least.get(name, np.inf), line["microseconds"])
    return [{"method": name, "microseconds": time} for name, time in least.items()]


def borders(rows: Rows) -> str:
    """Return the errors inside and at the border by the noise."""
    return as_markdown(pivoted(rows, "method", "noise", border_cell))


def border_cell(line: dict[str, Any]) -> str:
    """Return the errors inside and at the border as text."""
    failed = line["failed at the border"]
    return f"{formatted(line['inside'])} / {'none' if failed == 1 else _partly(line['border'], failed)}"


def _partly(error: float, failed: float) -> str:
    """Return an error as text, with the share of vertices without an estimate."""
    return formatted(error) + (f" ({100 * failed:.0f} %)" if failed >= 0.005 else "")


def _images(pictures: Mapping[str, str], start: str) -> list[str]:
    """Return figures of one kind; of curves all but the cubic's, on which methods differ most, are links."""
    named = [name for name in pictures if name.startswith(start)]
    return [f"{'!' if start == 'map_' or '_cubic_' in name else ''}[{pictures[name]}]({name}.png)" for name in named]
