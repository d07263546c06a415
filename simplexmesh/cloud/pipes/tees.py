"""Branches: lines whose axis meets that of a straight of another one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, norm, normalized
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.cloud.pipes.ends import reversed_chain
from simplexmesh.cloud.pipes.follow import line_of
from simplexmesh.cloud.pipes.line import PipeElement, PipeLine
from simplexmesh.cloud.pipes.refining import covariance_of
from simplexmesh.cloud.pipes.tolerances import ALIKE, MEETING, SLIGHT
from simplexmesh.data.primitives import Cylinder, Fit
from simplexmesh.numerics.round_fits import between_axes

REACH = 2.0
"""Distance of the end of a branch from the axis of its run, in radii of that: its surface, and a weld or a shadow."""


def with_tees(lines: list[PipeLine], tree: cKDTree, origin: Array) -> tuple[list[PipeLine], list[PipeElement]]:
    """Return lines with branches that meet their runs exactly, and the tees between them."""
    out, tees = list(lines), []
    for k in _runs_first(out):
        for _ in range(2):  # at the end, then at the start
            met = _met(out[k], out)
            if met is not None:
                i, element, place = met
                run = out[i].elements[element]
                out[k] = replace(_secant(out[k], place, tree, origin), stops=(out[k].stops[0], "tee"))
                tees.append(_tee(out[k].chain, run.radius, place))
            out[k] = _reversed(out[k])
    return out, tees


def _runs_first(lines: list[PipeLine]) -> list[int]:
    """Return the numbers of lines in an order in which runs come before the branches that are moved to them."""
    ways = ((line, _reversed(line)) for line in lines)
    runs = [{met[0] for way in both if (met := _met(way, lines)) is not None} for both in ways]
    order: list[int] = []
    while left := set(range(len(lines))) - set(order):
        order += [k for k in sorted(left) if not runs[k] & left] or [min(left)]  # in circles one is the first
    return order


def _met(branch: PipeLine, lines: list[PipeLine]) -> tuple[int, int, Array] | None:
    """Return the line and the straight of it whose axis the end of a branch meets, and where."""
    end, along = branch.chain.corners[-1], branch.chain.directions[-1]
    for i, line in enumerate(lines):
        if line.labels is branch.labels or branch.chain.closed:
            continue
        for k, element in enumerate(line.elements):
            axis = normalized(element.end - element.start)
            sine = float(norm(cross(along, axis)))
            if (
                element.kind != "straight"
                or sine < np.sin(SLIGHT)
                or branch.chain.radii[-1] > (1 + ALIKE) * element.radius
            ):
                continue
            ahead, before, apart, _ = between_axes(end, along, element.start, axis)
            near = abs(apart) < MEETING * element.radius and 0 < ahead < REACH * element.radius / sine
            if near and -element.radius < -before < element.length + element.radius:
                return i, k, element.start - before * axis
    return None


def _secant(line: PipeLine, place: Array, tree: cKDTree, origin: Array) -> PipeLine:
    """Return a line refined with the axis at its end through a place."""
    points = np.asarray(tree.data)[line.labels >= 0]
    corners = line.chain.corners - origin
    end = corners[-1].copy()
    corners[-1] = place - origin
    start = replace(line.chain, corners=corners)
    fixed = np.zeros(start.n_parameters, bool)
    fixed[3 * len(corners) - 4 : 3 * len(corners) - 2] = True
    chain = solve(start, points, fixed=fixed, loss_scale=WITHIN * line.rms)
    corners = chain.corners.copy()
    corners[-1] += (end - corners[-1]) @ chain.directions[-1] * chain.directions[-1]
    chain = replace(chain, corners=corners)
    covariance = covariance_of(chain, points, WITHIN * line.rms, fixed)
    return line_of(tree, origin, chain, covariance, line.rms, line.stops)


def _reversed(line: PipeLine) -> PipeLine:
    """Return a line from its end to its start, with elements the same way around."""
    return replace(line, chain=reversed_chain(line.chain), stops=line.stops[::-1])


def _tee(branch: Chain, radius: float, place: Array) -> PipeElement:
    """Return the tee between the axis of a run and the end of a branch."""
    end, own = branch.corners[-1], float(branch.radii[-1])
    length = float(norm(end - place))
    fit = Fit(np.nan, np.nan, np.full((5, 5), np.nan), checks.frozen([[-np.pi, np.pi], [0.0, length]]), 0)
    cylinder = Cylinder(place, end - place, own).with_fit(fit)
    ends = checks.frozen(place), checks.frozen(end)
    return PipeElement("tee", *ends, radius, own, None, None, length, cylinder, None)
