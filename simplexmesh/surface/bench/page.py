"""The page of a report: ratings, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

import simplexmesh
from simplexmesh.surface.bench import peers, published, ratings
from simplexmesh.surface.bench.curve import Curve
from simplexmesh.surface.bench.report import TITLE
from simplexmesh.surface.bench.tables import as_markdown, bullets, formatted, pivoted

if TYPE_CHECKING:
    from simplexmesh.surface.bench.run import Results

KINDS = {"curvature": "Curvatures", "normals": "Normals"}
SHORT = ("method", "precision", "convergence", "stability", "clouds", "complexity")
NUMBERS = ("method", "at a point", "on meshes", "worst on a mesh", "right limits", "converge", "order", "spread")
NOTHING = 1e-12
ROUNDED = 1e-9
SHOWN = "_cubic_"
"""Of the curves those of this surface are shown: on it methods differ most; on a plane none errs."""
WHAT = {"H": "Relative error of H", "K": "Relative error of K", "N": "Mean angle of normals in degrees"}


def index(found: Results, pictures: Mapping[str, str], *, quick: bool) -> str:
    """Return the page in Markdown."""
    parts = [
        TITLE,
        "All methods of `simplexmesh.curvature` and `simplexmesh.vertex_normals` on surfaces with known normals and "
        "curvatures, after the comparison in Charton's thesis (2014) and the article of 2012. "
        f"simplexmesh {simplexmesh.__version__}{', quick run' if quick else ''}.",
        *_ratings(found),
        *_pointwise(found, pictures),
        *_meshes(found, pictures),
        *_tilts(found),
        *_noise(found),
        *_peers(found),
        *_border(found),
        "## Surfaces in color",
        *_images(pictures, "map_"),
    ]
    return "\n\n".join(parts) + "\n"


def _ratings(found: Results) -> list[str]:
    parts = ["## Ratings", "From best to worst `+++ ++ + +/- - -- ---`, by these rules:", ratings.RULES]
    for kind, title in KINDS.items():
        if rows := found.ratings[kind]:
            parts += [
                f"### {title}",
                as_markdown(rows, SHORT),
                "The numbers they are based on:",
                as_markdown(rows, NUMBERS),
            ]
            lines = differences(kind, rows)
            if lines:
                parts += ["The thesis's ratings, and why ours differ:", as_markdown(lines)]
    return [*parts, ratings.WORK]


def differences(kind: str, rows: list[dict[str, Any]]) -> list[dict[str, str]]:
    """Return the comparison with the thesis's ratings, without the complexities."""
    return [line for line in ratings.compared(kind, rows) if line["why"] or line["criterion"] != "complexity"]


def _pointwise(found: Results, pictures: Mapping[str, str]) -> list[str]:
    curves = [*found.curves["curvature"], *found.curves["normals"]]
    rows = [
        _summary(name, quantity, [c for c in curves if (c.method, c.quantity) == (name, quantity)])
        for name, quantity in dict.fromkeys((c.method, c.quantity) for c in curves)
    ]
    return [
        "## One point, neighbors at decreasing distances",
        "Five patterns of 6 and 12 neighbors around the origin, at 0.5 to 0.0005; curvatures with the exact normal. "
        "Shares of cases that are monotone, have a limit, have the correct limit, are exact; median order of "
        "the others. All cases: [pointwise.csv](pointwise.csv); differences between patterns at equal distance: "
        "[spread.csv](spread.csv). Methods that need whole meshes are left out.",
        as_markdown(rows),
        *_images(pictures, "pointwise_"),
    ]


def _summary(name: str, quantity: str, curves: list[Curve]) -> dict[str, Any]:
    orders = [c.order for c in curves if np.isfinite(c.order)]
    shares = {
        label: float(np.mean([getattr(c, flag) for c in curves]))
        for label, flag in (
            ("monotone", "monotone"),
            ("has limit", "has_limit"),
            ("right limit", "limit_is_correct"),
            ("exact", "exact"),
        )
    }
    return {"method": name, "quantity": quantity, **shares, "order": float(np.median(orders)) if orders else None}


def _meshes(found: Results, pictures: Mapping[str, str]) -> list[str]:
    parts = [
        "## Whole meshes",
        "Mean and largest error over inner vertices, with exact initial normals for curvatures, at size "
        f"{ratings.SIZE}; all sizes: [meshes.csv](meshes.csv). H and K have units, 1 / length and its square.",
    ]
    for quantity, label in (("H", "H"), ("K", "K"), ("N", "The normal, |N - truth|")):
        every = [line for line in found.meshes if line["quantity"] == quantity]
        every = [line | {"place": f"{line['surface']} {line['mesh']}".replace("_", " ")} for line in every]
        if rows := [line for line in every if line["size"] == ratings.SIZE]:
            parts += [f"{label}:", as_markdown(pivoted(rows, "place", "method", _mean_and_max))]
            parts += [
                "Order of the mean error, where it is above rounding:",
                as_markdown(_orders(every)),
            ]
    return [*parts, *_images(pictures, "meshes_")]


def _mean_and_max(line: dict[str, Any]) -> str:
    return " / ".join("0" if line[name] < NOTHING else f"{line[name]:.1e}" for name in ("mean error", "max error"))


def _tilts(found: Results) -> list[str]:
    parts = [
        "## Tilted initial normals",
        "Median error over surfaces and patterns, neighbors at 0.1, when the initial normal is tilted by an angle in "
        "degrees. Of H in units of the largest curvature. Also in [tilts.csv](tilts.csv).",
    ]
    for quantity, label in (("H", "H"), ("N", "The normal, |N - truth|")):
        if rows := [line for line in found.tilts if line["quantity"] == quantity]:
            parts += [f"{label}:", as_markdown(pivoted(rows, "method", "degrees", lambda line: float(line["error"])))]
    return parts


def _orders(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the order of convergence of mean errors, fitted to the finest four sizes, one row per mesh."""
    out: dict[str, dict[str, Any]] = {}
    for key in dict.fromkeys((line["place"], line["method"]) for line in rows):
        mine = [line for line in rows if (line["place"], line["method"]) == key][-4:]
        known = [(line["size"], line["mean error"]) for line in mine if line["mean error"] > ROUNDED]
        row = out.setdefault(key[0], {"place": key[0]})
        fits = len(known) == len(mine) >= 3
        sizes, errors = np.log(np.array(known or [(1, 1)], float)).T
        row[key[1]] = f"{-np.polyfit(sizes, errors, 1)[0]:.1f}" if fits else None
    return list(out.values())


def _noise(found: Results) -> list[str]:
    parts = [
        "## Noise",
        "Mean error of H over inner vertices of a spherical cap, z = sqrt(4 - x^2 - y^2) on 50 x 50 cut squares, with "
        "uniform noise of a total width given in diagonals of the bounding box; normals by area. All levels, and K: "
        "[noise.csv](noise.csv). The article's numbers grow as if each level's noise had been added to the level "
        "before; both variants are given. Its tables 10 and 11 are in italics: its random axis is one per vertex, in "
        "both directions, so that the noise is twice as wide as along normals.",
    ]
    for along in ("normals", "directions"):
        for cumulative in (False, True):
            rows = [
                line
                for line in found.noise
                if (line["along"], line["cumulative"], line["quantity"]) == (along, cumulative, "H")
                and line["amount"] in published.NOISE_AMOUNTS
            ]
            if rows:
                table = pivoted(rows, "method", "amount", lambda line: float(line["mean"]))
                if cumulative:
                    table += _printed_noise(along, list(table[0]))
                added = "cumulative" if cumulative else "independent levels"
                direction = "normals" if along == "normals" else "a random direction per vertex"
                parts += [f"Along {direction}, {added}:", as_markdown(table)]
    return parts


def _printed_noise(along: str, amounts: list[str]) -> list[dict[str, Any]]:
    return [
        {"method": f"*{name}, article*"}
        | {
            str(amount): value
            for amount, value in zip(published.NOISE_AMOUNTS, values, strict=True)
            if str(amount) in amounts
        }
        for name, values in published.NOISE[along]["H"].items()
    ]


def _peers(found: Results) -> list[str]:
    parts = [
        "## Tori, with other programs",
        "Relative L2 error of each method with its defaults, and with three rings if it takes any neighborhood: torus "
        "of radius 1 and tube 0.35, regular or with vertices moved on the surface and quads split at random; normal "
        "noise in every coordinate. In brackets the share of vertices without an estimate, which are left out. "
        "With failures and times: [tori.csv](tori.csv).",
    ]
    titles = {case.title: _column(case) for case in peers.CASES}
    for quantity, label in WHAT.items():
        rows = [line | {"column": titles[line["case"]]} for line in found.peers if line["quantity"] == quantity]
        if not rows:
            continue
        table = pivoted(rows, "method", "column", error_cell)
        if quantity == "H":
            table += _other_programs(list(titles.values())[: len(published.OTHERS["VTK"])], list(table[0]))
        parts += [f"{label}:", as_markdown(table)]
    times: list[dict[str, Any]] = pivoted(
        [
            line | {"method": f"{line['method']} (normals)" if line["quantity"] == "N" else line["method"]}
            for line in found.peers
            if line["quantity"] in "HN"
        ],
        "method",
        "case",
        lambda line: float(line["microseconds"]),
    )
    least = [{"method": row.pop("method"), "microseconds": min(row.values())} for row in times]
    return [*parts, "Microseconds per vertex, the least over these meshes:", as_markdown(least)]


def _border(found: Results) -> list[str]:
    if not found.border:
        return []
    return [
        "## Borders",
        "Relative error of H on half an irregular torus of 10k, inside / at the border, with noise in mean edges; "
        "`none` where a method has no estimate at the border. Also in [border.csv](border.csv).",
        as_markdown(pivoted(found.border, "method", "noise", border_cell)),
    ]


def border_cell(line: dict[str, Any]) -> str:
    """Return the errors inside and at the border as text."""
    if line["failed at the border"] == 1:
        return f"{formatted(line['inside'])} / none"
    share = 100 * line["failed at the border"]
    return f"{formatted(line['inside'])} / {formatted(line['border'])}" + (f" ({share:.0f} %)" if share >= 0.5 else "")


def error_cell(line: dict[str, Any]) -> str:
    """Return an error as text, with the share of vertices without an estimate."""
    share = 100 * line["failed"] / line["vertices"]
    return formatted(float(line["error"])) + (f" ({share:.0f} %)" if share >= 0.5 else "")


def _column(case: peers.Case) -> str:
    kind = "" if case.irregular else "regular "
    noise = f", {100 * case.noise:g} %" + (" of diagonal" if case.unit == "diagonal" else "") if case.noise else ""
    return f"{'ellipsoid ' if case.shape == 'ellipsoid' else ''}{kind}{case.size}{noise}"


def _other_programs(columns: list[str], kept: list[str]) -> list[dict[str, Any]]:
    return [
        {"method": f"*{name}*"} | {c: float(v) for c, v in zip(columns, values, strict=True) if c in kept}
        for name, values in published.OTHERS.items()
    ]


def _images(pictures: Mapping[str, str], start: str) -> list[str]:
    names = [name for name in pictures if name.startswith(start)]
    if start == "map_":
        return [
            f"{pictures[name][:1].upper()}{pictures[name][1:]}:\n\n![{pictures[name]}]({name}.png)" for name in names
        ]
    if not names:
        return []
    first = next((name for name in names if SHOWN in name), names[0])
    rest = bullets(f"[{pictures[name]}]({name}.png)" for name in names if name != first)
    return [rest, f"![{pictures[first]}]({first}.png)"]
