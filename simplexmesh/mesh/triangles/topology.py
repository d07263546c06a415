"""Topology of a triangulated surface: components, borders, genus, Euler characteristic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base.arrays import Indices, Indices32
from simplexmesh.mesh import _kernels, manifold


@dataclass(frozen=True)
class Topology:
    """Topological invariants of a surface.

    Attributes
    ----------
    n_components : int
        Connected components; sheets that touch only in a vertex count separately.
    n_borders : int
        Closed loops of border edges, those of one triangle; 0 on a closed surface.
    genus : int
        Number of handles, summed over the components.
    euler : int
        V - E + F = 2 n_components - 2 genus - n_borders.
    """

    n_components: int
    n_borders: int
    genus: int
    euler: int


def surface_topology(faces: Indices) -> Topology:
    """Return the topology of triangles, whatever their orientation; duplicate and degenerate ones are ignored."""
    faces, mates, _ = manifold.matched(faces)
    manifold.to_flip(faces, mates)  # raises on one-sided surfaces
    components = _kernels.component_labels(np.where(mates >= 0, mates // 3, -1).astype(np.int32))
    fans = vertex_fans(faces, mates)
    n_border = int(np.count_nonzero(mates < 0))
    euler = int(fans.max()) + 1 - (mates.size + n_border) // 2 + len(faces)
    n_components = int(components.max()) + 1
    n_borders = _n_border_loops(fans, mates) if n_border else 0
    return Topology(n_components, n_borders, (2 * n_components - n_borders - euler) // 2, euler)


def vertex_fans(faces: Indices, mates: Indices) -> Indices32:
    """Return the fan (t, 3) of each corner: corners of one vertex whose triangles are connected across its edges."""
    corner = np.arange(faces.size).reshape(-1, 3)
    across = []
    for edge in (mates, np.roll(mates, 1, axis=1)):  # half-edge j leaves corner j, half-edge j - 1 arrives there
        start, end = edge, 3 * (edge // 3) + (edge + 1) % 3
        same = faces.ravel()[start] == faces.ravel()[corner]
        across.append(np.where(edge < 0, -1, np.where(same, start, end)))
    links = np.stack(across, axis=-1).reshape(-1, 2).astype(np.int32)
    return _kernels.component_labels(links).reshape(-1, 3)


def _n_border_loops(fans: Indices32, mates: Indices) -> int:
    """Return the number of border loops; border edges are linked at the fans they bound, two at each."""
    border = mates < 0
    ends = np.stack([fans[border], np.roll(fans, -1, axis=1)[border]], axis=1)
    order = np.argsort(ends.ravel(), kind="stable")
    partner = np.zeros(ends.size, np.int64)
    partner[order] = order.reshape(-1, 2)[:, ::-1].ravel()
    return int(_kernels.component_labels((partner // 2).reshape(-1, 2).astype(np.int32)).max()) + 1
