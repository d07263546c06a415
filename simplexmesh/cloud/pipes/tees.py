"""Branches: lines whose axis meets that of a straight of another one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.vectors import cross, norm, normalized
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.cloud.pipes.ends import reversed_chain
from simplexmesh.cloud.pipes.follow import line_of
from simplexmesh.cloud.pipes.line import PipeElement, PipeLine
from simplexmesh.cloud.pipes.refining import TIGHT, covariance_of
from simplexmesh.cloud.primitives import Cylinder, Fit

Array = NDArray[np.float64]

MEETING = 0.3
"""Distance between the axes of branch and run, in radii of the run, that meet."""

REACH = 2.0
"""Distance of the end of a branch from the axis of its run, in radii of that: its surface, and a weld or a shadow."""

LEAST_TURN = np.radians(20)
"""Between branch and run."""


def with_tees(lines: list[PipeLine], tree: cKDTree, origin: Array) -> tuple[list[PipeLine], list[PipeElement]]:
    """Return lines with branches that meet their runs exactly, and the tees between them."""
    out, tees = list(lines), []
    for k in range(len(out)):
        for _ in range(2):  # at the end, then at the start
            met = _met(out[k], [line for i, line in enumerate(out) if i != k])
            if met is not None:
                run, place, direction = met
                out[k] = _secant(out[k], place, tree, origin)
                tees.append(_tee(out[k].chain, run, place, direction))
            out[k] = _reversed(out[k])
    return out, tees


def _met(branch: PipeLine, others: list[PipeLine]) -> tuple[float, Array, Array] | None:
    """Return radius, place and direction of the run whose axis the end of a branch meets."""
    end, along = branch.chain.corners[-1], branch.chain.directions[-1]
    for line in others:
        for element in line.elements:
            if element.kind != "straight":
                continue
            axis = normalized(element.end - element.start)
            across = cross(along, axis)
            sine = float(norm(across))
            if sine < np.sin(LEAST_TURN) or branch.chain.radii[-1] > 1.05 * element.radius:
                continue
            ahead, back, apart = np.linalg.solve(np.stack([along, -axis, across / sine], axis=1), element.start - end)
            near = abs(apart) < MEETING * element.radius and 0 < ahead < REACH * element.radius / sine
            if near and -element.radius < back < element.length + element.radius:
                return element.radius, element.start + back * axis, axis
    return None


def _secant(line: PipeLine, place: Array, tree: cKDTree, origin: Array) -> PipeLine:
    """Return a line refined with the axis at its end through a place."""
    points = np.asarray(tree.data)[line.labels >= 0]
    corners = line.chain.corners - origin
    end, corners[-1] = corners[-1], place - origin
    start = replace(line.chain, corners=corners)
    fixed = np.zeros(start.n_parameters, bool)
    fixed[3 * len(corners) - 4 : 3 * len(corners) - 2] = True
    chain, _ = solve(start, points, fixed=fixed, loss_scale=TIGHT * line.rms)
    corners = chain.corners.copy()
    corners[-1] += (end - corners[-1]) @ chain.directions[-1] * chain.directions[-1]
    chain = replace(chain, corners=corners)
    covariance = covariance_of(chain, points, TIGHT * line.rms, fixed)
    return line_of(tree, origin, chain, covariance, line.rms, line.stops)


def _reversed(line: PipeLine) -> PipeLine:
    """Return a line from its end to its start, with elements the same way around."""
    return replace(line, chain=reversed_chain(line.chain), stops=line.stops[::-1])


def _tee(branch: Chain, radius: float, place: Array, direction: Array) -> PipeElement:
    """Return the tee between the axis of a run and the end of a branch."""
    end, own = branch.corners[-1], float(branch.radii[-1])
    length = float(norm(end - place))
    fit = Fit(np.nan, np.nan, np.full((5, 5), np.nan), checks.frozen([[-np.pi, np.pi], [0.0, length]]), 0)
    cylinder = Cylinder(place, end - place, own).with_fit(fit)
    ends = checks.frozen(place), checks.frozen(end)
    return PipeElement("tee", *ends, radius, own, None, None, length, cylinder, None)
