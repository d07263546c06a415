"""Where a pipe goes on with another diameter on the same or a parallel axis: it is found, and joined by a reducer."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.vectors import cross, norm, tangents
from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.cloud.pipes.refining import near_surface
from simplexmesh.cloud.pipes.tolerances import ALIKE, BAND, FEWEST, LOOSE, PARALLEL, SEEN, SLIGHT
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings

NARROWEST, WIDEST = 0.3, 3.0
"""Radii that may follow, over the present one."""

PEAKED = 0.04
"""Deviation over the radius of the distances from the axis of points on one pipe."""

FARTHEST = 8.0
"""Height in radii up to which a pipe on the same or a parallel axis begins, behind a reducer that may be seen from the
narrow side."""

DRAWS = 400
"""Pairs of points through which circles are drawn."""

SECTIONS = 4
"""Of an eccentric reducer, of which each is seen."""

CLOSE = 0.9
"""Of the points between pipes that a reducer joins, share that the noise explains, at least: heads of vessels bulge."""


def next_pipe(around: Surroundings, place: Array, direction: Array) -> tuple[float, Array] | None:
    """Return the radius of the pipe behind a reducer at an end, seen as a circle, and where its axis begins."""
    r, frame = around.radius, np.stack([*tangents(direction), direction])
    at = around.near(place + 0.5 * FARTHEST * r * direction, 0.5 * FARTHEST * r + WIDEST * r)
    local = (around.points[at] - place) @ frame.T
    fine = (local[:, 2] > 0) & (local[:, 2] < FARTHEST * r) & (norm(local[:, :2]) < WIDEST * r)
    local, normals = local[fine], around.normals(at[fine]) @ frame.T
    level = np.abs(normals[:, 2]) < SLIGHT
    flat, height = local[level, :2], local[level, 2]
    if len(flat) < FEWEST:
        return None
    centers, radii = _circles(flat, normals[level, :2], PEAKED * r)
    fine = _may_join(r, radii, norm(centers)) & (np.abs(radii / r - 1) > ALIKE) & (radii > NARROWEST * r)
    centers, radii = centers[fine], radii[fine]
    on = np.abs(norm(flat - centers[:, None]) - radii[:, None]) < PEAKED * np.minimum(radii, r)[:, None]
    best = int(on.sum(axis=1).argmax()) if len(on) else 0
    if not len(on) or on[best].sum() < FEWEST:
        return None
    counts, edges = np.histogram(height[on[best]], bins=np.arange(0, FARTHEST * r, radii[best] / 4))
    start = edges[int((counts > counts.max() / 2).argmax())]
    return float(radii[best]), place + centers[best] @ frame[:2] + start * direction


def _circles(flat: Array, normals: Array, tolerance: float) -> tuple[Array, Array]:
    """Return middles and radii of circles through random pairs of points (n, 2) at right angles to their normals."""
    i, j = np.random.default_rng(0).integers(0, len(flat), (2, DRAWS))
    sine = normals[i, 0] * normals[j, 1] - normals[i, 1] * normals[j, 0]
    i, j, sine = (each[np.abs(sine) > SLIGHT] for each in (i, j, sine))
    between = flat[j] - flat[i]
    far = (between[:, 0] * normals[j, 1] - between[:, 1] * normals[j, 0]) / sine
    centers = flat[i] + far[:, None] * normals[i]
    one, other = norm(flat[i] - centers), norm(flat[j] - centers)
    fine = np.abs(one - other) < tolerance
    return centers[fine], (one + other)[fine] / 2


def _may_join(radius: float, other: ArrayLike, offset: ArrayLike) -> Mask:
    """Return whether of two circles one is within the other, as a reducer joins them."""
    return np.less(offset, np.abs(np.subtract(other, radius)) + PEAKED * np.maximum(radius, other))


def is_joint(around: Surroundings, chain: Chain, deviation: float, k: int, between: Array) -> bool:
    """Whether points are seen all along a change of the radius, as beside it, and few off it between the pipes."""
    j, low, high = int(chain.changes[k, 0]), *chain.changes[k, 1:]
    wide = float(chain.radii[k : k + 2].max())
    feet = chain.feet(around.points[near_surface(around, chain, BAND * wide)])
    off, height = np.abs(feet.distance[feet.piece == 2 * j]), feet.along[feet.piece == 2 * j]
    here = off[(height > min(low, between[0])) & (height < max(high, between[1]))]
    height = height[off < PEAKED * wide]
    beside = [((height > start) & (height < start + wide)).sum() / wide for start in (low - wide, high)]
    counts = np.histogram(height, bins=np.linspace(low, high, SECTIONS + 1))[0] * SECTIONS / (high - low)
    seen = high - low > norm(chain.offsets[k]) and counts.min() > SEEN * min(beside)
    return bool(seen and (here < 3 * deviation).sum() > CLOSE * len(here))


def joined(one: Chain, other: Chain) -> Chain | None:
    """Return two chains as one whose radius changes where they meet; None if it does not, or no reducer joins them."""
    u, v = one.directions[-1], other.directions[0]
    base, r, after = one.corners[-2], float(one.radii[-1]), float(other.radii[0])
    across = cross(u, cross(other.corners[0] - one.corners[-1], u))
    eccentric = norm(across) > LOOSE * min(r, after)  # at first
    if abs(after / r - 1) < ALIKE / 2:  # what began as another pipe was traced back to this one
        return None
    if norm(cross(u, v)) > np.sin(PARALLEL) or u @ v < 0 or (eccentric and not _may_join(r, after, norm(across))):
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
    offsets = np.concatenate([one.offsets, [across * eccentric], other.offsets])
    return Chain(corners, bends, radii, changes, offsets)
