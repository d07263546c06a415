"""Ratings by explicit rules."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from simplexmesh.bench.trials.candidates import REGISTRIES
from simplexmesh.bench.trials.curve import LIMIT_TOLERANCE, Curve
from simplexmesh.bench.trials.pointwise import spreads

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


def rated(kind: str, name: str, curves: Sequence[Curve], meshes: Sequence[dict[str, Any]]) -> dict[str, Any]:
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
