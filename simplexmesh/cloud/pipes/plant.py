"""All pipe lines of a cloud: beginnings found by themselves, lines followed, branches joined to their runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain as chained
from typing import Any, TypeGuard, cast

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import warn
from simplexmesh._base.progress import Progress, part_of, reporting
from simplexmesh.cloud.extraction.extract import extract_primitives
from simplexmesh.cloud.extraction.result import Extraction
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.given_cloud import given_cloud
from simplexmesh.cloud.pipes.doubts import is_peaked, is_round
from simplexmesh.cloud.pipes.ends import with_stops
from simplexmesh.cloud.pipes.follow import followed, line_of, on_line, radius_limits
from simplexmesh.cloud.pipes.line import PipeElement, PipeLine, Pipes
from simplexmesh.cloud.pipes.tees import REACH, with_tees
from simplexmesh.cloud.pipes.tolerances import ALIKE, BAND, FEWEST, SHORT
from simplexmesh.cloud.pipes.tracing.seeds import likely_picks
from simplexmesh.cloud.pipes.tracing.start import Beginning, beginning
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings
from simplexmesh.cloud.pipes.tracing.tracking import JUMP
from simplexmesh.data.points import PointCloud
from simplexmesh.data.primitives import Cylinder, Primitive, Torus
from simplexmesh.numerics import scan_lines
from simplexmesh.numerics.scan_lines import Even

PRIMITIVES = 0.6
"""Part of the progress that finding primitives takes."""

FAILURES = 20
"""Picks in a row that lead to no pipe, after which there are no more."""

MOSTLY = (0.05, 0.95)
"""Shares of the points of a cylinder before both ends of the stretch that is surely of it, and of no bend."""

SOLID = ("plane", "sphere")
"""Kinds of which no pipe is part: their points are set aside before lines are followed."""


@dataclass(frozen=True, eq=False, repr=False)
class Plant(Pipes):
    """The pipe lines of a cloud.

    Attributes
    ----------
    lines : tuple of PipeLine
        The lines, those with more points first.
    elements : tuple of PipeElement
        Of all lines in order, then the tees, from the axis of a run to the start of its branch.
    labels : (n,) array of int
        Line of each point of the cloud, -1 for those of none.
    unit : str or None
        Unit of length of the cloud, if it is known.
    cylinders : tuple of Cylinder
        Those of the cloud that no line follows: vessels, and pieces shorter than three radii or of few points.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> turn, height = np.random.default_rng(0).uniform([0, 0], [2 * np.pi, 12], (6000, 2)).T
    >>> plant = sm.extract_pipes(np.stack([np.cos(turn), np.sin(turn), height], axis=1))
    >>> len(plant.lines), [element.kind for element in plant.lines[0].elements]
    (1, ['straight'])
    """

    lines: tuple[PipeLine, ...]
    tees: tuple[PipeElement, ...]
    labels: Indices
    unit: str | None = None
    cylinders: tuple[Cylinder, ...] = ()

    def __repr__(self) -> str:
        lines, elements = len(self.lines), len(self.elements)
        counts = f"{lines} line{'s' * (lines != 1)}, {elements} element{'s' * (elements != 1)}"
        return f"Plant({counts}, {int((self.labels >= 0).sum()):,} of {len(self.labels):,} points)"

    @property
    def elements(self) -> tuple[PipeElement, ...]:
        """All elements, line by line, then the tees."""
        return (*(element for line in self.lines for element in line.elements), *self.tees)


def extract_pipes(
    cloud: Any,
    *,
    radius: float | tuple[float, float] | None = None,
    gap: float = JUMP,
    rng: np.random.Generator | int = 0,
    progress: bool | Progress = False,
) -> Plant:
    """Find all pipe lines of a cloud, follow each, and refine each as one surface with exact tangency.

    The primitives of the cloud are found first, and the points of planes and spheres set aside. Lines are followed from
    its cylinders, its tori, and then from points whose neighbors are rounder than flat. Branches whose axes meet that
    of a run are fitted again so that they meet it exactly.

    Parameters
    ----------
    cloud : PointCloud, (n, 3) array, or path
        Points.
    radius : float or (float, float), optional
        The radius of all pipes, or the least and the greatest.
    gap : float
        Longest shadow to jump over, in radii of the pipe, as in `follow_pipe`.
    rng : int or Generator
        For the choice of picks.
    progress : bool or callable, optional
        Whether to show a bar, or what to call with the fraction done and a message.

    Returns
    -------
    Plant
        The lines, none where there is no pipe.

    Warns
    -----
    SimplexMeshWarning
        No pipe has the radius that was asked for, but there are cylinders: it may be in another unit.

    References
    ----------
    T. Chaperon, thesis, Ecole des Mines de Paris, 2002, sections 3.2, 3.3 and 7.2.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> turn, height = np.random.default_rng(0).uniform([0, 0], [2 * np.pi, 12], (6000, 2)).T
    >>> plant = sm.extract_pipes(np.stack([np.cos(turn), np.sin(turn), height], axis=1))
    >>> [round(line.elements[0].radius, 3) for line in plant.lines]
    [1.0]
    """
    data = given_cloud(cloud)
    limits, reach = radius_limits(radius), checks.number("gap", gap, 0.0)
    generator = checks.generator("rng", rng)
    with reporting(progress, "finding pipes") as report:
        scene = extract_primitives(data, rng=generator, progress=part_of(report, 0.0, PRIMITIVES))
        plant = _plant(data, scene, limits, reach, generator, part_of(report, PRIMITIVES, 1.0))
        report(1.0, "following pipes")
    radii = [each.radius for each in scene.primitives if isinstance(each, Cylinder)]
    if radii and not plant.lines and not any(_is_wanted(each, limits) for each in radii):
        warn(f"no pipe has the radius that was asked for: cylinders have {min(radii):.4g} to {max(radii):.4g}")
    return replace(plant, cylinders=tuple(_left_over(scene, plant.labels, limits)))


def _is_wanted(radius: float, limits: tuple[float, float]) -> bool:
    """Whether a radius that was measured is within limits, or about one that is given."""
    wanted = float(np.clip(radius, *limits))
    return abs(radius - wanted) < ALIKE * wanted


def _left_over(scene: Extraction, lines: Indices, limits: tuple[float, float]) -> Iterator[Cylinder]:
    """Yield the cylinders of a scene most of whose points are of no line."""
    for k, each in enumerate(scene.primitives):
        wanted = isinstance(each, Cylinder) and _is_wanted(each.radius, limits)
        if wanted and (lines[scene.labels == k] < 0).mean() > 0.5:
            yield cast(Cylinder, each)


def _plant(
    data: PointCloud,
    scene: Extraction,
    limits: tuple[float, float],
    gap: float,
    rng: np.random.Generator,
    report: Progress,
) -> Plant:
    """Return the lines among the points that are of no plane and no sphere."""
    of_pipes = np.array([*(each.kind not in SOLID for each in scene.primitives), True])
    kept = np.flatnonzero(of_pipes[scene.labels])
    labels = np.full(len(data.points), -1)
    if len(kept) < FEWEST:
        return Plant((), (), checks.frozen(labels), data.unit)
    origin = data.bounds.mean(axis=0)
    tree = cKDTree(data.points[kept] - origin, balanced_tree=False, compact_nodes=False)
    taken, tried = np.zeros(len(kept), bool), scene.labels[kept] >= 0  # lines begin at primitives first
    even = scan_lines.even(tree)
    in_pipes = _in_pipes(scene, scene.labels[kept], even, origin, limits, gap, taken)
    starts = chained(in_pipes, _picked(even, limits, gap, taken, tried, scene.noise, rng))
    lines, tees = with_tees(_lines(tree, origin, starts, taken, tried, report), tree, origin)
    whole = cKDTree(data.points - origin, balanced_tree=False, compact_nodes=False)
    for k, line in enumerate(lines):
        own = np.full(len(labels), -1)
        own[kept] = line.labels
        lines[k] = with_stops(replace(line, labels=checks.frozen(own), unit=data.unit), whole, origin)
        labels[(own >= 0) & (labels < 0)] = k
    return Plant(tuple(lines), tuple(tees), checks.frozen(labels), data.unit)


def _in_pipes(
    scene: Extraction, labels: Indices, even: Even, origin: Array, limits: tuple[float, float], gap: float, taken: Mask
) -> Iterator[Beginning]:
    """Yield beginnings along the cylinders, then amid the tori of a scene, but for those whose points are taken.

    Runs come before their branches, which are followed on what is not taken: they would turn into runs as wide as they.
    """
    found = [(k, each) for k, each in enumerate(scene.primitives) if _may_be_of_pipe(each)]
    runs = [each for _, each in found if isinstance(each, Cylinder)]

    def order(pair: tuple[int, Cylinder | Torus]) -> int:
        return 2 if isinstance(pair[1], Torus) else int(any(_leaves(pair[1], run) for run in runs))

    for k, each in sorted(found, key=order):
        place, direction, seen = _middle(each)
        own = labels == k
        if taken[own].mean() <= 0.5 and _is_wanted(seen, limits):
            radius, given = float(np.clip(seen, *limits)), limits[0] == limits[1]
            points = even.points[even.rows[~taken[even.rows]]]
            around = Surroundings(points, radius, radius_is_given=given, noise=scene.noise)
            heights = (even.points[own] - (place - origin)) @ direction
            low, high = np.quantile(heights, MOSTLY) if isinstance(each, Cylinder) else (0.0, 0.0)
            yield Beginning(around, place - origin, direction, gap, (low, high))


def _may_be_of_pipe(shape: Primitive) -> TypeGuard[Cylinder | Torus]:
    """Whether a primitive is a cylinder, or a torus that is no whole ring."""
    if isinstance(shape, Torus):
        return bool(np.ptp(cast(Array, shape.extent)[0]) < 1.5 * np.pi)
    return isinstance(shape, Cylinder)


def _middle(pipe: Cylinder | Torus) -> tuple[Array, Array, float]:
    """Return a place on the axis of a pipe in the middle of its points, the direction there, and its radius."""
    if isinstance(pipe, Cylinder):
        return _ends(pipe).mean(axis=0), pipe.axis, pipe.radius
    turn = cast(Array, pipe.extent)[0].mean()
    out = np.cos(turn) * pipe.frame[0] + np.sin(turn) * pipe.frame[1]
    return pipe.center + pipe.radius * out, np.cross(pipe.axis, out), pipe.tube_radius


def _ends(pipe: Cylinder) -> Array:
    """Return the ends (2, 3) of the axis of a fitted cylinder."""
    heights = cast(Array, pipe.extent)[1]
    return pipe.point + heights[:, None] * pipe.axis


def _leaves(branch: Cylinder, run: Cylinder) -> bool:
    """Whether an end of one cylinder is at the side of another one."""
    ends, (start, end), r = _ends(branch), _ends(run), run.radius
    beside = ((ends - start) @ run.axis > r) & ((end - ends) @ run.axis > r)
    return bool((beside & (run.distance(ends) < (REACH - 1) * r)).any())


def _picked(
    even: Even,
    limits: tuple[float, float],
    gap: float,
    taken: Mask,
    tried: Mask,
    noise: float,
    rng: np.random.Generator,
) -> Iterator[Beginning]:
    """Yield beginnings at likely points that are neither taken nor tried, until many lead to none.

    No point is tried that is near another one: what is wrong there, at the edge of a beam, is wrong with both.
    """
    failures, found = 0, 0
    for pick in even.rows[likely_picks(even.points[even.rows], noise, rng)]:
        if taken[pick] or tried[pick]:
            continue
        tried[even.near(np.array([pick]), FEWEST)[1]] = True
        failures, found = (failures + 1, found) if taken.sum() == found else (1, int(taken.sum()))
        if failures > FAILURES:
            return
        with suppress(ValueError, np.linalg.LinAlgError):
            yield beginning(even.tree, even.points[pick], limits, gap, noise)


def _lines(
    tree: cKDTree, origin: Array, starts: Iterable[Beginning], taken: Mask, tried: Mask, report: Progress
) -> list[PipeLine]:
    """Return the lines that start somewhere, those with more points first; their points become taken, others' tried."""
    lines: list[PipeLine] = []
    for start in starts:
        report(float(taken.mean()), "following pipes")
        try:
            chain, covariance, deviation, stops = followed(start)
            wide, distance = on_line(chain, tree, BAND * float(chain.radii.min()))
            at = wide[np.abs(distance) < WITHIN * deviation]
            tried[wide] = True
            short = chain.stations[-1] < 2 * SHORT * chain.radii.max() or len(at) < FEWEST
            if short or taken[at].mean() > 0.5 or not is_peaked(distance, deviation):
                continue
            if not is_round(chain, np.asarray(tree.data)[at]):
                continue
            lines.append(line_of(tree, origin, chain, covariance, deviation, stops))
        except (ValueError, np.linalg.LinAlgError):
            continue
        taken[wide[np.abs(distance) < 2 * WITHIN * deviation]] = True
    return sorted(lines, key=lambda line: -int((line.labels >= 0).sum()))
