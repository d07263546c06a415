"""Ratings by explicit rules, compared with those of the thesis, with the reasons for differences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from simplexmesh.bench.tables import Rows
from simplexmesh.bench.trials.candidates import REGISTRIES
from simplexmesh.bench.trials.curve import LIMIT_TOLERANCE, Curve
from simplexmesh.bench.trials.pointwise import spreads
from simplexmesh.bench.trials.published import CRITERIA, THESIS

Limits = Sequence[tuple[float, str]]

DISTANCE, SIZE = 0.1, 32
"""Distance of the neighbors and size of the meshes at which precision and stability are evaluated."""

MIN_ERROR = 1e-7
"""Smaller errors count as this, so that exact cases do not dominate geometric means."""

LARGE_ERROR = 1.0
"""An error of H or N at any vertex of a mesh above which a method is unstable."""

GRADES = ("+++", "++", "+", "-", "--", "---")
PRECISION: Limits = tuple(zip((1e-4, 3e-4, 1e-3, 3e-3, 1e-2, np.inf), GRADES, strict=True))
STABILITY: Limits = tuple(zip((3e-3, 1e-2, 3e-2, 1e-1, 3e-1, np.inf), GRADES, strict=True))
CORRECT_LIMITS: Limits = ((0.6, "---"), (0.75, "--"), (0.9, "-"), (0.99, "+/-"))
ORDERS: Limits = ((1.5, "+"), (2.5, "++"), (np.inf, "+++"))


def _told(limits: Limits, word: str) -> str:
    return ", ".join(f"`{sign}` {word} {limit:g}" for limit, sign in limits if np.isfinite(limit))


RULES = f"""\
- **Precision**, of H or of the normal: the geometric mean of two numbers, each a geometric mean over all surfaces but
  the plane: the error at one point with neighbors at distance {DISTANCE}, over schemes and numbers of neighbors, in
  units of the largest principal curvature; and the mean error on meshes of size {SIZE}. Smaller errors count as
  {MIN_ERROR:g}. {_told(PRECISION, "up to")}, else
  `---`. Methods that need whole meshes are rated by the second number.
- **Convergence**: by the share of pointwise cases whose limit is correct within {LIMIT_TOLERANCE:g}:
  {_told(CORRECT_LIMITS, "below")}; from {CORRECT_LIMITS[-1][0]:g} on by the median order:
  {_told(ORDERS, "below")}, else `+++`.
- **Stability**: the range of estimates over the five schemes at distance {DISTANCE}, in the same units, averaged over
  surfaces and numbers of neighbors. {_told(STABILITY, "up to")},
  else `---`; at most `-` if the error at some inner vertex of a mesh of size {SIZE} exceeds {LARGE_ERROR:g}.
- For normals the limits of precision and stability are a tenth: an error of a normal causes one of curvatures about
  2 / d times as large.
- **Clouds**: whether it works without faces.
"""

EXPLAINED = {
    ("curvature", "chen_schmitt", "precision", "-"): "All surfaces have equal weight, and on those that are umbilic "
    "at the point it is as accurate as any; on whole meshes its errors are among the largest, as in the thesis.",
    ("curvature", "chen_schmitt", "stability", "-"): "At umbilics its estimate does not depend on the pattern, which "
    "brings the mean just below the limit; on the cubic and the cylinder the spread is far above it.",
    ("curvature", "discrete", "convergence", "---"): "By the thesis's definition, to any limit, it converges in "
    "nearly all cases; here limits must be correct, and in about half the cases they are not.",
    ("curvature", "langer", "convergence", "++"): "With angles measured in the tangent plane, not on the faces, its "
    "order is that of the sine; the slow cases named in the thesis are of first order for every method.",
    ("curvature", "langer", "stability", "-"): "Over the five patterns it agrees with the thesis; but two neighbors "
    "nearly at right angles make its weights diverge, on split squares along whole lines of vertices, as stated in "
    "the text of the thesis but not in its table.",
    ("curvature", "sine", "precision", "++"): "On meshes it is the best of the thesis's methods; at single points "
    "quadrics are better on the surfaces that are quadrics, as the thesis says. The mean is just above the limit.",
    ("curvature", "sine", "stability", "++"): "It depends on the pattern as much as Langer's quadrature and the "
    "quadric do: all three have the same first-order term where a surface has a cubic one.",
    ("curvature", "taubin", "precision", "-"): "Only H counts here; the thesis also counted K, which is much worse.",
    ("curvature", "taubin", "convergence", "--"): "The thesis counts correct and incorrect limits; a third of them "
    "are incorrect.",
    ("curvature", "taubin", "stability", "-"): "Its limits depend on the angles between neighbors, which is "
    "instability by our rule; the thesis seems to have judged how smoothly it varies.",
    ("normals", "area", "convergence", "+"): "It converges in every case, at first order.",
    ("normals", "plane", "precision", "--"): "It is less precise than area weights by more than one step of the scale.",
    ("normals", "plane", "stability", "--"): "Its spread is hardly larger than that of area weights, which have the "
    "same rating in both.",
    ("normals", "quadric", "stability", "++"): "It is within a factor of two of the extended sine.",
    ("normals", "chen_schmitt", "precision", "-"): "The thesis's text calls it the least precise and contradicts its "
    "table.",
    ("normals", "chen_schmitt", "convergence", "+"): "Its error is of first order in every case, in one of seven not "
    "monotone: the differences of the tangents vanish although their curvatures remain wrong.",
    ("normals", "chen_schmitt", "stability", "-"): "The thesis's text calls it unstable on nearly all graphs and "
    "contradicts its table.",
    ("normals", "extended_sine", "precision", "++"): "It is the most precise of the thesis's methods here too, but at "
    "the given distance and size none of them reaches the top of the scale.",
    ("normals", "extended_sine", "stability", "++"): "It is the most stable here too, just above the limit.",
}
"""By kind, method, criterion and our rating over all surfaces of the article: why the thesis's rating differs."""

UNEXPLAINED = "Not explained: reasons are given for all surfaces of the article together."


def rated(kind: str, name: str, curves: Sequence[Curve], meshes: Rows) -> dict[str, Any]:
    """Return a method's ratings and the numbers they are based on, from its curves and the rows of all on meshes."""
    quantity = "H" if kind == "curvature" else "N"
    mine = [curve for curve in curves if curve.quantity == quantity and curve.surface != "plane"]
    numbers = dict.fromkeys(
        ("at a point", "on meshes", "worst on a mesh", "right limits", "converge", "order", "spread")
    )
    if mine:
        orders = [curve.order for curve in mine if np.isfinite(curve.order)]
        nearest = mine[0].distances[np.argmin(np.abs(np.log(mine[0].distances / DISTANCE)))]
        numbers |= {
            "at a point": _geometric_mean([curve.error_at(DISTANCE) / curve.scale for curve in mine]),
            "right limits": np.mean([curve.limit_is_correct for curve in mine]),
            "converge": np.mean([curve.converges for curve in mine]),
            "order": np.median(orders) if orders else np.inf,
            "spread": np.nanmean([line["spread"] for line in spreads(mine) if line["distance"] == nearest]),
        }
    lines = [
        line
        for line in meshes
        if (line["method"], line["quantity"], line["size"]) == (name, quantity, SIZE)
        and line["surface"] != "plane"
        and np.isfinite(line["mean error"])
    ]
    if lines:
        numbers["on meshes"] = _geometric_mean([line["mean error"] for line in lines])
        numbers["worst on a mesh"] = max(line["max error"] for line in lines)
    return {
        "method": name,
        "precision": precision(kind, numbers),
        "convergence": convergence(numbers),
        "stability": stability(kind, numbers),
        "clouds": "no" if REGISTRIES[kind][name].needs_faces else "yes",
        **numbers,
    }


def compared(kind: str, ratings: Rows) -> Iterator[dict[str, str]]:
    """Yield a row for each rating that the thesis has too: ours, the thesis's, and the reason for a difference."""
    for rating in ratings:
        method = rating["method"]
        for criterion, theirs in zip(CRITERIA, THESIS[kind].get(method, ()), strict=False):
            ours = rating[criterion]
            why = "" if ours in (theirs, "") else EXPLAINED.get((kind, method, criterion, ours), UNEXPLAINED)
            yield {"method": method, "criterion": criterion, "here": ours, "thesis": theirs, "why": why}


def _geometric_mean(errors: Sequence[float]) -> float:
    """Return the geometric mean, without missing values."""
    known = np.asarray(errors, float)
    return float(np.exp(np.log(np.maximum(known[np.isfinite(known)], MIN_ERROR)).mean()))


def precision(kind: str, numbers: dict[str, Any]) -> str:
    """Return the grade of the mean error at points and on meshes, empty where neither is known."""
    known = [numbers[name] for name in ("at a point", "on meshes") if numbers[name] is not None]
    return _grade(_geometric_mean(known), PRECISION, kind) if known else ""


def convergence(numbers: dict[str, Any]) -> str:
    """Return the grade of the share of right limits and the order, empty where they are not known."""
    if numbers["right limits"] is None:
        return ""
    wrong = next((sign for share, sign in CORRECT_LIMITS if numbers["right limits"] < share), None)
    return wrong or next((sign for order, sign in ORDERS if numbers["order"] < order), "+++")


def stability(kind: str, numbers: dict[str, Any]) -> str:
    """Return the grade of the spread, empty where it is not known; a wild vertex caps it."""
    if numbers["spread"] is None:
        return ""
    sign = _grade(numbers["spread"], STABILITY, kind)
    outlier = numbers["worst on a mesh"] is not None and numbers["worst on a mesh"] > LARGE_ERROR
    return GRADES[max(GRADES.index(sign), GRADES.index("-"))] if outlier else sign


def _grade(value: float, limits: Limits, kind: str) -> str:
    """Return the grade of a number by its limits, a tenth for normals."""
    return next(sign for limit, sign in limits if value <= limit * (1.0 if kind == "curvature" else 0.1))
