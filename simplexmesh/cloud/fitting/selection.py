"""The simplest kind that is as good, and kinds that points do not tell from a simpler one (Chaperon 2002, 5.1)."""

from __future__ import annotations

from simplexmesh._base.arrays import Array
from simplexmesh.cloud.validation.selection import bic
from simplexmesh.cloud.validation.validation import NEGLIGIBLE
from simplexmesh.data.primitives import Primitive

SIMPLER = {
    "sphere": ("plane",),
    "cylinder": ("plane",),
    "cone": ("plane", "cylinder"),
    "torus": ("plane", "sphere", "cylinder"),
    "circle": ("line",),
}
"""What a kind is for an infinite radius, an angle of 0 or a ring of radius 0 (5.1.3)."""

SURFACES = ("plane", "sphere", "cylinder", "cone", "torus")
"""By the number of parameters."""

DECISIVE = 10.0
"""Difference of the criterion that is very strong evidence (Kass and Raftery 1995)."""


def score(primitive: Primitive, points: Array) -> float:
    """Return the Bayesian information criterion of distances of points (n, 3) of unit size: less is better."""
    count = len(points) * primitive.per_point
    distance = primitive.distance(points)
    return bic(float(distance @ distance) + count * NEGLIGIBLE**2, count, primitive.n_parameters)


def simplest(found: list[Primitive], points: Array) -> Primitive:
    """Return the first of primitives, which come by the number of parameters, than which no later is clearly better."""
    scores = [score(each, points) for each in found]
    best = 0
    for k, value in enumerate(scores):
        if value < scores[best] - DECISIVE:
            best = k
    return found[best]
