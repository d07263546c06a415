"""Lines of pipe and plants made without points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.cloud.pipes.elements import elements_of
from simplexmesh.cloud.pipes.line import PipeElement, PipeLine
from simplexmesh.cloud.pipes.plant import Plant
from simplexmesh.data.primitives import Cylinder, Fit

FEW = np.full(4, -1)
"""Labels of points that are of nothing."""


def line(at=(0.0, 0.0, 0.0), unit="m", offset=0.0):
    """A line of a straight, a bend, a straight with a reducer in it, a bend and a straight."""
    corners = np.array([[0, 0, 0], [4, 0, 0], [4, 3, 0], [4, 4, 5.0]]) + at
    chain = Chain(corners, np.array([0.5, 0.9]), np.array([0.2, 0.15]), np.array([[1.0, 1.0, 1.5]]))
    chain = replace(chain, offsets=np.array([[0.0, 0, offset]])).moved(np.zeros(chain.n_parameters + 2 * (offset > 0)))
    elements, _ = elements_of(chain, np.zeros((0, 3)), np.eye(chain.n_parameters), np.zeros(3))
    return PipeLine(elements, FEW, 0.0, ("end", "end"), chain, unit)


def plant(at=(0.0, 0.0, 0.0)):
    """A plant of a line and a tee."""
    one, start = line(at), np.array([2.0, 0, 0]) + at
    end = start + np.array([0, 0.5, 0])
    fit = Fit(0.0, 0.0, np.zeros((5, 5)), np.array([[-np.pi, np.pi], [0.0, 0.5]]), 0)
    tee = PipeElement("tee", start, end, 0.2, 0.1, None, None, 0.5, Cylinder(start, end - start, 0.1, fit), None)
    return Plant((one,), (tee,), FEW, "m")
