"""How far points of a plane are from a line of straight pieces, and on which side of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot, norm


class ProfileFeet(NamedTuple):
    """Nearest points (n,) of a line of pieces."""

    piece: Indices
    share: Array  # of the way along the piece
    distance: Array  # above 0 to the right of the line
    gradient: Array  # (n, 2)


def feet(corners: Array, at: Array) -> ProfileFeet:
    """Return the nearest points of the line through corners (m, 2), whose left is inside, to points (n, 2).

    A line that is not closed leads from and to where no point is, or to x = 0, where all are to the right.
    """
    count = len(at)
    square, inside = np.full(count, np.inf), np.zeros(count, bool)
    piece, share, off = np.zeros(count, np.int64), np.zeros(count), np.zeros((count, 2))
    along = np.diff(corners, axis=0)
    for k, (start, edge) in enumerate(zip(corners, along, strict=False)):
        to = at - start
        way = np.clip(to @ edge / (edge @ edge), 0, 1)
        left = np.where((way == 1)[:, None], at - corners[k + 1], to - way[:, None] * edge)  # exact of long pieces
        far = dot(left, left)
        nearer = far < square
        square[nearer], piece[nearer], share[nearer], off[nearer] = far[nearer], k, way[nearer], left[nearer]
        crossed = (to[:, 1] < 0) != (to[:, 1] < edge[1])  # by the ray towards greater x
        inside ^= crossed & ((to[:, 0] * edge[1] < to[:, 1] * edge[0]) == (edge[1] > 0))
    out = np.stack([along[:, 1], -along[:, 0]], axis=1) / norm(along)[:, None]
    across, far = out[piece], np.sqrt(square)
    at_corner = ((share == 0) | (share == 1)) & (far > 0)
    sign = np.where(inside, -1.0, 1.0)
    round_corner = sign[:, None] * off / np.maximum(far, 1e-300)[:, None]
    distance = np.where(at_corner, sign * far, dot(across, off))
    return ProfileFeet(piece, share, distance, np.where(at_corner[:, None], round_corner, across))
