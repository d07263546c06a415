"""Where a pipe goes on with another diameter on the same axis: it is found, and joined by a reducer."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, dot, norm, tangents
from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.cloud.pipes.tolerances import ALIKE, FACING, FEWEST, PARALLEL
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings
from simplexmesh.cloud.pipes.tracing.tracking import JUMP, SPREAD

NARROWEST, WIDEST = 0.3, 3.0
"""Radii that may follow, over the present one."""

PEAKED = 0.04
"""Deviation over the radius of the distances from the axis of points on one pipe."""

COAXIAL = 0.15
"""Offset in radii of axes that are taken for one."""


def next_radius(around: Surroundings, place: Array, direction: Array) -> tuple[float, Array] | None:
    """Return the radius of the coaxial pipe behind an end, and a place on its axis; None if there is none."""
    r = around.radius
    at = around.near(place + 0.5 * JUMP * r * direction, 0.5 * JUMP * r + WIDEST * r)
    away = around.points[at] - place
    height = away @ direction
    out = away - height[:, None] * direction
    rho = norm(out)
    fine = (height > 0) & (height < JUMP * r) & (rho > NARROWEST * r) & (rho < WIDEST * r)
    at, height, out, rho = at[fine], height[fine], out[fine], rho[fine]
    facing = np.abs(dot(around.normals(at), out)) > FACING * rho
    height, rho, flat = height[facing], rho[facing], out[facing] @ np.stack(tangents(direction)).T
    best: tuple[int, float, Array] | None = None
    for radius in r * np.arange(NARROWEST, WIDEST, PEAKED):
        near = np.abs(rho - radius) < PEAKED * radius
        if abs(radius / r - 1) < ALIKE or near.sum() < FEWEST or (best is not None and near.sum() <= best[0]):
            continue
        unit = flat[near] / rho[near, None]
        moments = np.linalg.eigvalsh(unit.T @ unit)
        if moments[0] > 2 * SPREAD * moments.sum():
            best = int(near.sum()), float(np.median(rho[near])), place + float(np.median(height[near])) * direction
    return None if best is None else best[1:]


def joined(one: Chain, other: Chain) -> Chain | None:
    """Return two chains as one whose radius changes where they meet; None if the axes there are not one."""
    u, v = one.directions[-1], other.directions[0]
    base = one.corners[-2]
    offset = norm(cross(other.corners[0] - one.corners[-1], u))
    if norm(cross(u, v)) > np.sin(PARALLEL) or u @ v < 0 or offset > COAXIAL * min(one.radii[-1], other.radii[0]):
        return None
    j = len(one.lengths) - 1
    end, start = (one.corners[-1] - base) @ u, (other.corners[0] - base) @ u
    gap = 0.02 * one.radii[-1]
    if start < end + gap:  # both runs were traced a little too far
        start, end = (start + end + gap) / 2, (start + end - gap) / 2
    moved = other.changes + np.array([j, 0.0, 0.0])
    moved[other.changes[:, 0] == 0, 1:] += (other.corners[0] - base) @ u
    changes = np.concatenate([one.changes, [[j, end, start]], moved])
    corners = np.concatenate([one.corners[:-1], other.corners[1:]])
    bends, radii = (np.concatenate([getattr(c, name) for c in (one, other)]) for name in ("bend_radii", "radii"))
    return Chain(corners, bends, radii, changes)
