"""Decimation and relaxation of closed triangulations, preserving their topology."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.motion.initial import _kernels_collapse, _kernels_remesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

ANY_COSINE = -2.0
"""Below any cosine: no limit to the turn of a triangle."""


def decimated(vertices: Array, faces: Indices, triangles: int) -> tuple[Array, Indices]:
    """Return a closed triangulation decimated to `triangles` triangles or one fewer, by shortest-edge collapses.

    The topology is preserved. Collapses that turn a triangle by more than 60 degrees come last, which keeps thin rods
    round. A triangulation that already has fewer triangles is returned unchanged.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(8).triangulated()
    >>> _, faces = decimated(ball.vertices, ball.faces, 500)
    >>> len(ball.faces), len(faces)
    (3840, 500)
    """
    if len(faces) <= triangles:
        return vertices, faces
    positions = np.array(vertices, dtype=float, order="C")
    mates = np.array(half_edge_mates(faces), dtype=np.int64).ravel()
    corners = np.array(faces, dtype=np.int64).ravel()
    for turn in (_kernels_remesh.MIN_COSINE, ANY_COSINE):
        if _kernels_collapse.collapse_shortest(positions, corners, mates, triangles, turn) <= triangles:
            break
    used, left = np.unique(corners[corners != _kernels_collapse.REMOVED], return_inverse=True)
    return positions[used], left.reshape(-1, 3)


def relaxed(
    vertices: Array, faces: Indices, *, rounds: int = 5, sweeps: int = 2, step: float = 0.5
) -> tuple[Array, Indices]:
    """Return a closed triangulation with valences closer to six and evenly distributed vertices.

    Each round flips edges, then moves the vertices `sweeps` times tangentially towards the centroids of their one-rings
    (Botsch and Kobbelt 2004, section 4, without splits and collapses).

    Parameters
    ----------
    vertices, faces : (v, 3) array of float, (t, 3) array of int
        Closed and oriented.
    rounds, sweeps : int
        Numbers of rounds, and of relaxation sweeps per round.
    step : float
        Fraction of the way moved per sweep.
    """
    positions = np.array(vertices, dtype=float, order="C")
    mates = np.array(half_edge_mates(faces), dtype=np.int64).ravel()
    corners = np.array(faces, dtype=np.int64).ravel()
    valence = np.bincount(corners, minlength=len(positions))
    for _ in range(rounds):
        flips = _kernels_remesh.flip_round(positions, corners, mates, valence)
        first = np.full(len(positions), -1)
        first[corners] = np.arange(len(corners))
        for _ in range(sweeps):
            _kernels_remesh.relax_round(positions, corners, mates, first, step)
        if not flips and not sweeps:
            break
    return positions, corners.reshape(-1, 3)
