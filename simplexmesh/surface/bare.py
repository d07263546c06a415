"""Faces without vertices of their own, as files from CAD have them: nothing at a vertex tells that they are flat."""

from __future__ import annotations

from weakref import WeakSet

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import cross, dot, norm, normalized
from simplexmesh.errors import warn
from simplexmesh.surface.samples import Samples

SHARP = np.radians(30.0)
"""Triangles that meet at more than this meet at an edge of the body."""

FLAT = np.radians(2.0)
"""Half of all other edges lie within a face where triangles meet at less; on rough scans they do not."""

MOSTLY = 0.5
"""Above this share of the area it is worth saying."""

_LOOKED_AT: WeakSet[Samples] = WeakSet()


def bare_share(samples: Samples) -> float:
    """Return the share of the area in triangles all of whose corners are on sharp edges, 0 without triangles.

    0 too where most other edges are not flat: then the surface is rough, not made of faces.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> from simplexmesh.surface.samples import as_samples
    >>> signs = np.array([[i, j, k] for i in (-1.0, 1) for j in (-1.0, 1) for k in (-1.0, 1)])
    >>> faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    >>> box = sm.TriangleMesh(signs, [[a, b, c] for a, b, c, _ in faces] + [[a, c, d] for a, _, c, d in faces])
    >>> bare_share(as_samples(box)), round(bare_share(as_samples(sm.divided(box, 0.2))), 3)  # at corners some are left
    (1.0, 0.004)
    """
    if samples.faces is None or not len(samples.faces):
        return 0.0
    faces, points = samples.faces, samples.points
    vectors = cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    areas = norm(vectors)
    on_edge = _on_sharp_edges(faces, normalized(vectors), areas > 0, len(points))
    return float(areas[on_edge[faces].all(axis=1)].sum() / areas.sum()) if areas.any() else 0.0


def _on_sharp_edges(
    faces: NDArray[np.int64], normals: NDArray[np.float64], sound: NDArray[np.bool_], n: int
) -> NDArray[np.bool_]:
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    keys = ends[:, 0] * n + ends[:, 1]
    order = np.argsort(keys, kind="stable")
    one, other = order[:-1], order[1:]
    pair = (keys[one] == keys[other]) & sound[one // 3] & sound[other // 3]
    one, other = one[pair], other[pair]
    cosine = dot(normals[one // 3], normals[other // 3])
    sharp, out = cosine < np.cos(SHARP), np.zeros(n, bool)
    if sharp.all() or np.median(cosine[~sharp]) > np.cos(FLAT):
        out[ends[one[sharp]]] = True
    return out


def tell_of_bare_faces(samples: Samples) -> None:
    """Warn, once, where most of a surface has no vertices that could tell how it bends."""
    if samples in _LOOKED_AT:
        return
    _LOOKED_AT.add(samples)
    share = bare_share(samples)
    if share > MOSTLY:
        warn(
            f"{share:.0%} of the surface lies between sharp edges without a vertex that tells how it bends, "
            "as in files from CAD; simplexmesh.divided(surface) gives it some"
        )
