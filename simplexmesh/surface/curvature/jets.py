"""Jets fitted around points at given scales."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.curvature import _kernels_adaptive as kernels
from simplexmesh.surface.curvature.scales import Scales
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Jets(NamedTuple):
    """Fits around c centers, in the order of the kernel's arguments; `shape` holds k1 and k2, (c, 2)."""

    shape: Array
    d1: Array
    normals: Array
    error: Array
    scale: Array
    reasons: NDArray[np.uint8]

    def some(self, rows: Indices) -> Jets:
        """Return some rows."""
        return Jets(*(part[rows] for part in self))  # type: ignore[arg-type]


class Links(Protocol):
    """Adjacency in CSR form: `Neighborhoods`, or part of them."""

    @property
    def offsets(self) -> Indices:
        """Start of each point's neighbors in `members`."""

    @property
    def members(self) -> Indices:
        """Neighbors of all points."""


def fitted(samples: Samples, rows: Indices, scales: Scales, links: Links) -> Jets:
    """Fit jets around the points `rows`, to the points within reach of the adjacency `links`."""
    n = len(rows)
    out = Jets(np.zeros((n, 2)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(n, np.uint8))
    fit = (part[rows] for part in scales[:5])
    seen = (links.offsets.view(np.uint64), links.members.view(np.uint64), samples.points)
    kernels.adaptive_jets(rows, *seen, scales.directions, scales.oriented, *fit, scales.noise, kernels.chunks(n), *out)
    return out
