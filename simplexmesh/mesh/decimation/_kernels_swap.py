"""Kernels on the dual triangulation of a decimated mesh: edge swaps (T7) that keep its shape, and vertex placement."""

from __future__ import annotations

from simplexmesh._base._kernels_njit import njit
from simplexmesh.mesh.decimation._kernels_collapse import triangle_normal, triangle_quality, turns
from simplexmesh.mesh.decimation._kernels_regions import Corners, Weights
from simplexmesh.mesh.operators._kernels_batch import imbalance
from simplexmesh.mesh.operators._kernels_contours import is_on_contour
from simplexmesh.mesh.operators._kernels_edit import DONE, EDITS, VERTICES, Darts, refuse_swap, rotate, rotate_edge
from simplexmesh.numerics._kernels_vectors import row


@njit(cache=True)
def is_fixed(d: Darts, c: Corners, vertex: int) -> bool:
    """Return whether a vertex is on a hole, a contour or a fixed face."""
    out = is_on_contour(d, vertex)
    for dart in range(3 * vertex, 3 * vertex + 3):
        out |= d.face_hole[d.face[dart]] or c.max_extent[d.face[dart]] == 0
    return out


@njit(cache=True, error_model="numpy")
def swap_degrades(d: Darts, c: Corners, dart: int, w: Weights) -> bool:
    """Return whether T7 rotates a dual triangle too far or makes one too thin."""
    back = d.twin[dart]
    left, right = row(c.points, d.face[dart]), row(c.points, d.face[back])
    near, far = row(c.points, d.face[rotate(dart)]), row(c.points, d.face[rotate(back)])
    quality = min(triangle_quality(left, far, near), triangle_quality(right, near, far))
    if quality < w.quality and quality < min(triangle_quality(near, left, right), triangle_quality(far, right, left)):
        return True
    before = triangle_normal(near, left, right), triangle_normal(far, right, left)
    after = triangle_normal(left, far, near), triangle_normal(right, near, far)
    for one in before:
        for other in after:
            if turns(one, other, w.turn):
                return True
    return False


@njit(cache=True)
def may_swap(d: Darts, c: Corners, dart: int, w: Weights) -> bool:
    """Return whether T7 on an edge is legal, evens out face sizes, and keeps what is fixed and the dual's shape."""
    if imbalance(d, dart) < 2 or is_fixed(d, c, dart // 3) or is_fixed(d, c, d.twin[dart] // 3):
        return False
    return refuse_swap(d, dart)[0] == DONE and not swap_degrades(d, c, dart, w)


@njit(cache=True)
def swap_unequal(d: Darts, c: Corners, w: Weights) -> None:
    """Apply T7 to imbalanced edges where it is allowed, in passes over all edges until none is left."""
    swapped = True
    while swapped:
        swapped = False
        for dart in range(3 * d.used[VERTICES]):
            if d.alive[dart // 3] and dart < d.twin[dart] and may_swap(d, c, dart, w):
                rotate_edge(d, dart)
                swapped = True
    d.used[EDITS] = 0


@njit(cache=True)
def place_vertices(d: Darts, c: Corners) -> None:
    """Place each vertex that is not fixed at the centroid of its dual triangle."""
    for i in range(d.used[VERTICES]):
        if d.alive[i] and not is_fixed(d, c, i):
            one, two, three = d.face[3 * i], d.face[3 * i + 1], d.face[3 * i + 2]
            for k in range(3):
                d.values[i, k] = (c.points[one, k] + c.points[two, k] + c.points[three, k]) / 3
