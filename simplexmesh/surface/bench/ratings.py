"""Ratings by explicit rules, compared with those of the thesis, with the reasons for differences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from simplexmesh.surface.bench.candidates import method
from simplexmesh.surface.bench.curve import Curve
from simplexmesh.surface.bench.pointwise import spreads
from simplexmesh.surface.bench.published import CRITERIA, THESIS

Rows = Sequence[dict[str, Any]]

DISTANCE, SIZE = 0.1, 32
"""Distance of the neighbors and size of the meshes at which precision and stability are evaluated."""

MIN_ERROR = 1e-7
"""Smaller errors count as this, so that exact cases do not dominate geometric means."""

GRADES = ("+++", "++", "+", "-", "--", "---")
PRECISION = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2)
STABILITY = (3e-3, 1e-2, 3e-2, 1e-1, 3e-1)
LIMIT_FACTOR = {"curvature": 1.0, "normals": 0.1}
CORRECT_LIMITS = ((0.6, "---"), (0.75, "--"), (0.9, "-"), (0.99, "+/-"))
ORDERS = ((1.5, "+"), (2.5, "++"))
LARGE_ERROR = 1.0


def _steps(limits: Sequence[float]) -> str:
    return ", ".join(f"`{sign}` up to {limit:g}" for sign, limit in zip(GRADES, limits, strict=False))


def _below(limits: Sequence[tuple[float, str]]) -> str:
    return ", ".join(f"`{sign}` below {limit:g}" for limit, sign in limits)


RULES = f"""\
- **Precision**, of H or of the normal: the geometric mean of two numbers, each a geometric mean over all surfaces but
  the plane: the error at one point with neighbors at distance {DISTANCE}, over schemes and numbers of neighbors, in
  units of the largest principal curvature; and the mean error on meshes of size {SIZE}. Smaller errors count as
  {MIN_ERROR:g}. {_steps(PRECISION)}, else
  `---`. Methods that need whole meshes are rated by the second number.
- **Convergence**: by the share of pointwise cases whose limit is correct within {1e-3:g}:
  {_below(CORRECT_LIMITS)}; from {CORRECT_LIMITS[-1][0]:g} on by the median order:
  {_below(ORDERS)}, else `+++`.
- **Stability**: the range of estimates over the five schemes at distance {DISTANCE}, in the same units, averaged over
  surfaces and numbers of neighbors. {_steps(STABILITY)},
  else `---`; at most `-` if the error at some inner vertex of a mesh of size {SIZE} exceeds {LARGE_ERROR:g}.
- For normals the limits of precision and stability are a tenth: an error of a normal causes one of curvatures about
  2 / d times as large.
- **Clouds**: whether it works without faces. **Complexity**: fitted to the times with one ring (6 neighbors) and
  three (36), if the method accepts both.
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

WORK = (
    "The thesis writes n^2 for fits with a fixed number of unknowns, which take time linear in n; only the sorting of "
    "all pairs in chen_schmitt takes more. The exponent here is fitted to the times with 6 and 36 neighbors, part of "
    "which is constant."
)


def rated(kind: str, name: str, curves: Sequence[Curve], meshes: Rows, times: Rows) -> dict[str, Any]:
    """Return a method's ratings and the numbers they are based on.

    Parameters
    ----------
    kind : {"curvature", "normals"}
    name : str
    curves : sequence of Curve
        Its pointwise curves, of H or of N.
    meshes : rows of `refinement.mesh_errors` with "surface" and "size"
    times : rows of `peers.case_errors`
    """
    quantity = "H" if kind == "curvature" else "N"
    mine = [curve for curve in curves if curve.quantity == quantity and curve.surface != "plane"]
    lines = [
        line
        for line in meshes
        if line["method"] == name
        and line["quantity"] == quantity
        and line["size"] == SIZE
        and line["surface"] != "plane"
        and np.isfinite(line["mean error"])
    ]
    near = [curve.error_at(DISTANCE) / curve.scale for curve in mine]
    numbers: dict[str, Any] = {
        "at a point": _geometric_mean(near) if near else None,
        "on meshes": _geometric_mean([line["mean error"] for line in lines]) if lines else None,
        "worst on a mesh": max(line["max error"] for line in lines) if lines else None,
        "right limits": np.mean([curve.limit_is_correct for curve in mine]) if mine else None,
        "converge": np.mean([curve.converges for curve in mine]) if mine else None,
        "order": _order(mine) if mine else None,
        "spread": _spread(mine) if mine else None,
    }
    registered = method(kind, name)
    return {
        "method": name,
        "precision": _precision(kind, numbers),
        "convergence": _convergence(numbers),
        "stability": _stability(kind, numbers),
        "clouds": "no" if registered.needs_faces else "yes",
        "complexity": _complexity(name, quantity, times),
        **numbers,
    }


def compared(kind: str, ratings: Rows) -> list[dict[str, str]]:
    """Return a row for each rating that the thesis has too: ours, the thesis's, and the reason for a difference.

    Complexities differ for one common reason, `WORK`.
    """
    lines = []
    for rating in ratings:
        printed = THESIS[kind].get(rating["method"])
        if printed is None:
            continue
        for criterion, theirs in zip(CRITERIA, printed[1:], strict=True):
            ours = rating[criterion]
            alike = ours in (theirs, "") or criterion == "complexity"
            why = "" if alike else EXPLAINED.get((kind, rating["method"], criterion, ours), UNEXPLAINED)
            lines.append(
                {"method": rating["method"], "criterion": criterion, "here": ours, "thesis": theirs, "why": why}
            )
    return lines


def _geometric_mean(errors: Sequence[float]) -> float:
    """Return the geometric mean, without missing values."""
    known = np.asarray(errors, float)
    return float(np.exp(np.log(np.maximum(known[np.isfinite(known)], MIN_ERROR)).mean()))


def _step(value: float, limits: Sequence[float], factor: float) -> str:
    """Return the grade of a number by its limits."""
    return GRADES[int(np.searchsorted(np.asarray(limits) * factor, value))]


def _precision(kind: str, numbers: dict[str, Any]) -> str:
    known = [numbers[name] for name in ("at a point", "on meshes") if numbers[name] is not None]
    return _step(_geometric_mean(known), PRECISION, LIMIT_FACTOR[kind]) if known else ""


def _convergence(numbers: dict[str, Any]) -> str:
    if numbers["right limits"] is None:
        return ""
    for share, sign in CORRECT_LIMITS:
        if numbers["right limits"] < share:
            return sign
    return next((sign for order, sign in ORDERS if numbers["order"] < order), "+++")


def _stability(kind: str, numbers: dict[str, Any]) -> str:
    if numbers["spread"] is None:
        return ""
    sign = _step(numbers["spread"], STABILITY, LIMIT_FACTOR[kind])
    outlier = numbers["worst on a mesh"] is not None and numbers["worst on a mesh"] > LARGE_ERROR
    return GRADES[max(GRADES.index(sign), GRADES.index("-"))] if outlier else sign


def _order(curves: Sequence[Curve]) -> float:
    """Return the median of the fitted orders; infinite if all are exact."""
    orders = [curve.order for curve in curves if np.isfinite(curve.order)]
    return float(np.median(orders)) if orders else float("inf")


def _spread(curves: Sequence[Curve]) -> float:
    """Return the mean spread over schemes at the distance for stability, without missing values."""
    at = curves[0].distances[np.argmin(np.abs(np.log(curves[0].distances / DISTANCE)))]
    return float(np.nanmean([line["spread"] for line in spreads(curves) if line["distance"] == at]))


def _complexity(name: str, quantity: str, times: Rows) -> str:
    """Return the exponent of the time per vertex in the number of neighbors."""
    spent = [
        min(
            (line["microseconds"] for line in times if line["method"] == label and line["quantity"] == quantity),
            default=0,
        )
        for label in (name, f"{name}, 3 rings")
    ]
    return f"n^{np.log(spent[1] / spent[0]) / np.log(6):.1f}" if all(spent) else ""
