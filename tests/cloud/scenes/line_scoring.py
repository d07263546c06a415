"""How well the elements of a followed pipe agree with those of the true line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from simplexmesh._base.vectors import norm
from tests.cloud.scenes.scoring import middle_and_most, ratio, relative

NEAR = 1.0
"""Both ends of a found element are nearer than this, in tube radii, to those of the true one."""


@dataclass(frozen=True)
class LineScore:
    """Shares of elements, whether they came in order, errors of radii, relative, and of ends in tube radii.

    `missed` are the numbers of the true elements that were not found.
    """

    precision: float
    recall: float
    ordered: bool
    radius: float
    worst_radius: float
    bend_radius: float
    worst_bend_radius: float
    worst_end: float
    missed: tuple[int, ...]


def line_score(found, line):
    """Compare elements, with `start`, `end`, `radius` and a positive `bend_radius` of bends only, with a line's.

    A line may be followed either way; its outer ends count like any. Reducers go by their ends alone.
    """
    true = line.elements
    away = np.array([[apart(one, other) for other in true] for one in found]).reshape(len(found), len(true))
    good = away < NEAR
    pairs = [(a, b) for a, b in zip(*linear_sum_assignment(np.where(good, away, 1e9)), strict=True) if good[a, b]]
    bends = [relative(found[a].bend_radius, true[b].bend_radius) for a, b in pairs if true[b].kind == "bend"]
    radii = [relative(found[a].radius, true[b].radius) for a, b in pairs if true[b].kind != "reducer"]
    steps = np.diff([b for _, b in pairs])
    radius, bend = middle_and_most(radii), middle_and_most(bends)
    return LineScore(
        precision=ratio(len(pairs), len(found)),
        recall=ratio(len(pairs), len(true)),
        ordered=bool((steps > 0).all() or (steps < 0).all()),
        radius=radius[0],
        worst_radius=radius[1],
        bend_radius=bend[0],
        worst_bend_radius=bend[1],
        worst_end=max((float(away[pair]) for pair in pairs), default=np.nan),
        missed=tuple(sorted({*range(len(true))} - {int(b) for _, b in pairs})),
    )


def apart(found, true):
    """How far the ends of two elements are apart, either way round, in tube radii; infinite for another kind."""
    if bool((found.bend_radius or 0) > 0) != (true.kind == "bend"):
        return np.inf
    ends, others = np.stack([found.start, found.end]), np.stack([true.start, true.end])
    return float(min(norm(ends - others).max(), norm(ends[::-1] - others).max())) / true.radius
