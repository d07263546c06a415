"""Primitives that suit a point and ever more of its neighbors (Chaperon 2002, 6.1 and 6.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import norm
from simplexmesh.cloud.extraction.working import FEW, Working, from_quadrics
from simplexmesh.cloud.fitting.candidates import STEPS
from simplexmesh.cloud.fitting.solver import Model, solve
from simplexmesh.cloud.fitting.starts import start
from simplexmesh.data.primitives import Cone, Primitive

LEAST = 24
"""Points of the smallest patch: three to each parameter of a torus, half as many where noise is small."""

DOUBLINGS = 7
"""Of the patch: up to 3072 neighbors."""

LOOKED_AT = 160
"""Points of a patch that are fitted."""

SLACK = 1.3
"""Deviations of the noise that a patch may have: of 24 points 1 in 50 has more by chance."""

COARSE, COARSEST = 1.5, 10.0
"""Noise of a place or primitive, in that of the cloud, from which and up to which it is its own: that of depth cameras
is so much larger over a table than nearby."""

SMOOTH = 0.25
"""Share of the neighborhoods in a patch that tell its noise: in others there may be an edge or a stray."""

AFTER = {
    "": (("plane",), ("sphere", "cylinder"), ("cone", "torus")),
    "plane": (("sphere", "cylinder"), ("cone", "torus")),
    "sphere": (("cylinder",), ("cone", "torus")),
    "cylinder": (("cone", "torus"), ("sphere",)),
    "cone": (("cylinder",), ("torus",)),
    "torus": (("sphere", "cylinder"), ("cone",)),
}
"""What a patch may turn out to be as it grows, the simplest kinds first."""


@dataclass(frozen=True)
class Limits:
    """Kinds that are looked for, the least and greatest radius, and the fewest points."""

    kinds: Sequence[str]
    radii: tuple[float, float]
    fewest: int

    def allow(self, primitive: Primitive | None, size: float) -> bool:
        """Return whether a primitive near points of a size is wanted, and not degenerate (5.1.3)."""
        if primitive is None or primitive.kind not in self.kinds:
            return False
        if primitive.kind == "plane":
            return True
        if isinstance(primitive, Cone):
            return SLIMMEST < primitive.half_angle < STEEPEST
        low, high = self.radii
        thick = primitive._shape[-1]
        return low <= thick <= high and thick < FLATTEST * size and primitive._shape[0] < FLATTEST * size


FLATTEST = 10.0
"""Radius, in sizes of the points, above which they are taken for flat."""


SLIMMEST, STEEPEST = np.radians([1, 85])
"""Half angles of cones: below they are cylinders, above planes."""


def patch(work: Working, near: Indices, limits: Limits) -> Primitive | None:
    """Return the primitive of the largest patch of nearest neighbors `near` (t,) whose distances are noise, or None."""
    found, size = None, LEAST // (2 if work.fine else 1)
    noise = noise_about(work, near[:LEAST])
    for _ in range(DOUBLINGS + 1):
        members = near[:size]
        some = members[:: -(-len(members) // LOOKED_AT)]
        fitted = suited(work.points[some], work.normals[some], noise, limits, found)
        if fitted is None:
            break
        found = fitted
        if size >= len(near):
            break
        size *= 2
    return found


def noise_about(work: Working, members: Indices) -> float:
    """Return the noise of the cloud, or that of a place where it is clearly more, as that of dark or far parts is."""
    shown = float(np.quantile(from_quadrics(work.points[work.near[members, :FEW]]), SMOOTH))
    return min(shown, COARSEST * work.noise) if shown > COARSE * work.noise else work.noise


def suited(points: Array, normals: Array, noise: float, limits: Limits, before: Primitive | None) -> Primitive | None:
    """Return a primitive whose distances of points are noise: that of before, refined, or else of another kind."""
    if before is not None:
        again = refined(before, points)
        if error(again, points) <= SLACK * noise:
            return again
    size = float(norm(points - points.mean(axis=0)).max())
    for kinds in AFTER[before.kind if before is not None else ""]:
        tried = [fit(kind, points, normals) for kind in kinds if kind in limits.kinds]
        good = [each for each in tried if each is not None and limits.allow(each, size)]
        errors = [error(each, points) for each in good]
        if errors and min(errors) <= SLACK * noise:
            return good[int(np.argmin(errors))]
    return None


def fit(kind: str, points: Array, normals: Array) -> Primitive | None:
    """Return the primitive of a kind from its closed form, refined."""
    found = start(kind, points, normals)
    if found is None or kind == "plane":
        return found
    return refined(found, points)


def refined(primitive: Model, points: Array, scale: float | None = None) -> Model:
    """Return what is moved to the least sum of squared distances, or of robust ones of a scale."""
    return solve(primitive, points, loss_scale=scale, iterations=STEPS, tolerance=1e-4)


def error(primitive: Primitive, points: Array) -> float:
    """Return the deviation of the noise that distances show (Chaperon 2002, 5.1)."""
    distance = primitive.distance(points)
    return float(np.sqrt(distance @ distance / max(len(points) - primitive.n_parameters, 1)))
