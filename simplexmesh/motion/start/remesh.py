"""Decimation and relaxation of closed triangulations, preserving their topology.

Relaxation is that of Botsch and Kobbelt 2004, section 4, without splits and collapses. Neither is left to others: the
decimation of libigl lets triangles turn over, so that 3 of 7 thin walls stay tangled however often they are thickened,
in twice the time; swaps of edges (T7) of the dual alone leave 5 and 11 vertices of starts for a head CT tangled.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.mesh.triangles._kernels_half_edges import MIN_COSINE
from simplexmesh.motion.start import _kernels_remesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def decimated(vertices: Array, faces: Indices, triangles: int) -> tuple[Array, Indices]:
    """Return a closed triangulation decimated to `triangles` triangles or one fewer, by collapses of shortest edges.

    Collapses that turn a triangle by more than 60 degrees come last, which keeps thin rods round.
    """
    if len(faces) <= triangles:
        return vertices, faces
    positions = np.array(vertices, dtype=float, order="C")
    mates = np.array(half_edge_mates(faces), dtype=np.int64).ravel()
    corners = np.array(faces, dtype=np.int64).ravel()
    for cosine in (MIN_COSINE, -2.0):
        if _kernels_remesh.collapse_shortest(positions, corners, mates, triangles, cosine) <= triangles:
            break
    used, left = np.unique(corners[corners != _kernels_remesh.REMOVED], return_inverse=True)
    return positions[used], left.reshape(-1, 3)


def relaxed(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Return a closed triangulation with edges flipped towards valence six, and vertices evenly spread tangentially."""
    positions = np.array(vertices, dtype=float, order="C")
    mates = np.array(half_edge_mates(faces), dtype=np.int64).ravel()
    corners = np.array(faces, dtype=np.int64).ravel()
    valence = np.bincount(corners, minlength=len(positions))
    for _ in range(6):
        _kernels_remesh.flip_round(positions, corners, mates, valence)
        first = np.full(len(positions), -1)
        first[corners] = np.arange(len(corners))
        for _ in range(2):
            _kernels_remesh.relax_round(positions, corners, mates, first, 0.5)
    return positions, corners.reshape(-1, 3)
