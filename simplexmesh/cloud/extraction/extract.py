"""Extract primitives from a cloud."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.progress import Progress, reporting
from simplexmesh.cloud.extraction.elbows import with_elbows
from simplexmesh.cloud.extraction.finishing import described, labeled
from simplexmesh.cloud.extraction.joint import Parts, refit, together
from simplexmesh.cloud.extraction.patches import LEAST, Limits
from simplexmesh.cloud.extraction.result import Extraction
from simplexmesh.cloud.extraction.search import found_one_by_one
from simplexmesh.cloud.extraction.working import Working, working
from simplexmesh.cloud.fitting.selection import SURFACES
from simplexmesh.cloud.fitting.starts import scaled
from simplexmesh.cloud.given_cloud import given_cloud
from simplexmesh.data.points import PointCloud, distinct

SHARE = 1e-3
"""Of the points, those that a primitive has at least, by default."""

FEWEST = 50
"""... but no fewer than these, which tell a torus from noise."""

ALWAYS = "plane"
"""Looked for in any case, as otherwise walls and beams have cylinders on them."""


def extract_primitives(
    cloud: Any,
    *,
    kinds: Sequence[str] = SURFACES,
    noise: float | None = None,
    fewest: int | None = None,
    least_radius: float = 0.0,
    greatest_radius: float = np.inf,
    rng: np.random.Generator | int = 0,
    progress: bool | Progress = False,
) -> Extraction:
    """Find the planes, spheres, cylinders, cones and tori that a cloud is made of, and which points are of each.

    The noise and the distances between points are measured, the noise of rougher parts where they are. About random
    points, primitives are fitted to ever larger patches as long as the distances are noise; the one that explains the
    most connected points is taken, with the kind that does so best, and so on with the points that are left. Then all
    are seen together: cylinders of like radius whose axes meet are joined by a bend, the torus tangent to both, points
    take the primitive that explains them best as those about them do, what others explain as well is given up, and all
    are fitted again, pipes with their bends as one.

    Parameters
    ----------
    cloud : PointCloud, array, path or object of another library
        At least 24 different points. Shapes are looked for among at most 100,000 of them, drawn at random, fewer where
        they are dense along lines of a scanner; all points are labeled.
    kinds : sequence of str
        The kinds that are wanted: "plane", "sphere", "cylinder", "cone", "torus". Planes are looked for in any case, so
        that no walls are taken for wide cylinders, and are left out if they are not wanted.
    noise : float, optional
        Deviation of the points along normals; otherwise it is measured. Parts may have up to eight times as much.
    fewest : int, optional
        Points of a primitive, at least; by default a thousandth of all, or 50 if these are more.
    least_radius, greatest_radius : float
        Limits of the radii of spheres, cylinders and tubes of tori.
    rng : int or Generator
        Draws the places that are looked at.
    progress : bool or callable, optional
        Whether to show a bar, or what to call with the fraction done and a message.

    Returns
    -------
    Extraction
        `primitives`, `labels` (n,), `leftovers`; it can be saved and shown.

    Raises
    ------
    ValueError
        Fewer than 24 different points, points on a curve, NaN, an unknown kind, limits that leave no radius.
    TypeError
        What is no cloud, kinds that are no names, progress that is neither True nor False nor a function.

    Warns
    -----
    SimplexMeshWarning
        Coordinates that were stored as 32-bit numbers far from the origin, and have lost digits.

    Notes
    -----
    Points at three deviations from a surface at most are of it. A shape with fewer points within reach of each other
    than `fewest` is not found, nor one whose radius is less than about twice the distance between points.

    References
    ----------
    T. Chaperon, *Segmentation de nuage de points 3D*, 2002, chapter 6. R. Schnabel, R. Wahl, R. Klein, *Efficient
    RANSAC for point-cloud shape detection*, 2007.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> rng = np.random.default_rng(0)
    >>> turn, along = rng.uniform([0, 0], [2 * np.pi, 4], (3000, 2)).T
    >>> pipe = np.stack([np.cos(turn), np.sin(turn), along], axis=1)
    >>> floor = np.append(rng.uniform(-3, 3, (4000, 2)), np.full((4000, 1), -0.5), axis=1)
    >>> scene = sm.extract_primitives(np.concatenate([pipe, floor]) + rng.normal(0, 0.01, (7000, 3)))
    >>> [each.kind for each in scene.primitives], round(scene.primitives[1].radius, 2)
    (['plane', 'cylinder'], 1.0)
    """
    given = given_cloud(cloud)
    (limits, names), generator = _limits(kinds, least_radius, greatest_radius), checks.generator("rng", rng)
    deviation = None if noise is None else checks.number("noise", noise, 0.0, open_low=True)
    wanted = None if fewest is None else checks.integer("fewest", fewest, LEAST)
    first, inverse = distinct(given.points)
    if len(first) < LEAST:
        raise ValueError(f"cloud must have at least {LEAST} different points, not {len(first)}")
    points = given.points[first]
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    size = float(np.linalg.norm(np.ptp(points, axis=0))) / 2
    with reporting(progress, "finding primitives") as report:
        report(0.0, "looking at the points")
        unit = (points - middle) / size
        work = working(unit, None if deviation is None else deviation / size, generator)
        share = len(work.points) / len(points)
        count = max(FEWEST, SHARE * len(points)) if wanted is None else wanted
        limits = Limits(
            limits.kinds, (limits.radii[0] / size, limits.radii[1] / size), max(LEAST, round(share * count))
        )
        found = found_one_by_one(work, limits, generator, report)
        report(0.8, "seeing all together")
        if "torus" in limits.kinds:
            found = with_elbows(work, found, limits, generator)
        state = together(work, found, limits)
        report(0.9, "labelling all points")
        state.labels = labeled(work, state, unit)
        refit(unit, state)
        report(1.0, "labelling all points")
    return _finished(given, work, state, names, inverse, middle, size, generator)


def _limits(kinds: Sequence[str], low: float, high: float) -> tuple[Limits, tuple[str, ...]]:
    """Return what is looked for, in the cloud's unit, and the kinds that are wanted of that."""
    if not isinstance(kinds, Iterable):
        raise TypeError(f"kinds must be a sequence of names, not {checks.type_name(kinds)}")
    given = [kinds] if isinstance(kinds, str) else list(kinds)
    names = tuple(checks.choice("kinds", kind, SURFACES) for kind in given)
    if not names:
        raise ValueError("kinds must name at least one of " + ", ".join(SURFACES))
    least = checks.number("least_radius", low, 0.0)
    greatest = np.inf if high == np.inf else checks.number("greatest_radius", high, 0.0)
    if not least < greatest:
        raise ValueError(f"greatest_radius must be above least_radius, {least:g}, not {greatest:g}")
    return Limits(tuple(kind for kind in SURFACES if kind in (*names, ALWAYS)), (least, greatest), LEAST), names


def _finished(
    cloud: PointCloud,
    work: Working,
    state: Parts,
    names: tuple[str, ...],
    inverse: Indices,
    middle: Array,
    size: float,
    rng: np.random.Generator,
) -> Extraction:
    """Return primitives in the cloud's own unit, those of the most points first, with how they were fitted."""
    labels = state.labels[inverse]
    counts = np.bincount(labels[labels >= 0], minlength=len(state.primitives))
    order = np.argsort(-counts, kind="stable")
    order = order[[counts[k] > 0 and state.primitives[k].kind in names for k in order]]
    rank = np.full(len(state.primitives) + 1, -1)
    rank[order] = np.arange(len(order))
    labels = rank[labels]
    primitives = tuple(
        described(scaled(state.primitives[k], size, middle), cloud.points[labels == rank[k]], rng) for k in order
    )
    bends = [(state.first_bend + k, bend.first, bend.second) for k, bend in enumerate(state.bends)]
    joined = tuple(tuple(int(rank[k]) for k in each) for each in bends if (rank[list(each)] >= 0).all())
    return Extraction(cloud, primitives, checks.frozen(labels), work.noise * size, joined)  # type: ignore[arg-type]
