"""The topology of a solid on a grid: its pieces, cavities and tunnels, counted and mended.

A solid is a boolean grid whose inside cells are joined through faces (6 neighbors) and whose outside cells are joined
through corners too (26 neighbors), so that inside and outside never cross (Rosenfeld 1970). Its border is empty.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh.motion.initial import _kernels_grid

Mask = NDArray[np.bool_]

_CORNERS = np.ones((3, 3, 3))
_WIDE = 2  # layers that a hollow is deeper than, or it is but a cleft


def genus(solid: Mask) -> int:
    """Return the number of tunnels of a solid without cavities: the genus of its surface, over all its pieces.

    It is the number of pieces minus the Euler number of the complex whose vertices are the inside cells, whose edges,
    squares and cubes are the pairs, fours and eights of inside cells (Kong and Rosenfeld 1989).

    Examples
    --------
    >>> ring = np.zeros((5, 5, 3), bool)
    >>> ring[1:4, 1:4, 1] = True
    >>> genus(ring)
    0
    >>> ring[2, 2, 1] = False
    >>> genus(ring)
    1
    """
    return int(ndimage.label(solid)[1]) - euler(solid)


def euler(solid: Mask) -> int:
    """Return the Euler number of a solid: pieces - tunnels + cavities."""
    number = 0
    for corner in range(8):
        cells = solid
        for axis in range(3):
            if corner >> axis & 1:
                front, back = [slice(None)] * 3, [slice(None)] * 3
                front[axis], back[axis] = slice(1, None), slice(None, -1)
                cells = cells[tuple(front)] & cells[tuple(back)]
        number += (-1) ** (corner.bit_count()) * int(np.count_nonzero(cells))
    return number


def pieces(
    solid: Mask, components: str = "largest", smallest: float = 0.0, *, corners: bool = False
) -> tuple[Mask, int]:
    """Return the solid with only its largest piece, or all of at least `smallest` cells, and how many were dropped.

    With `corners`, cells that touch at a corner belong to the same piece.
    """
    label, count = ndimage.label(solid, _CORNERS if corners else None)
    if count <= 1:
        return solid, 0
    size = np.bincount(label.ravel())
    size[0] = 0
    kept = np.zeros(count + 1, bool)
    kept[size.argmax()] = True
    if components == "all":
        kept |= size >= max(1.0, smallest)
        kept[0] = False
    return kept[label], count - int(kept.sum())


def without_cavities(solid: Mask) -> Mask:
    """Return the solid with every hollow filled that the outside does not reach; its border must be empty."""
    label, count = ndimage.label(~solid, _CORNERS)
    return label != label[0, 0, 0] if count > 1 else solid


def closed(solid: Mask, radius: float) -> Mask:
    """Return the morphological closing of a solid by a ball of `radius` cells, cavities filled.

    The solid must lie at least `radius` + 1 cells from the border.
    """
    grown = ndimage.distance_transform_edt(~solid) <= radius
    return without_cavities(_with((ndimage.distance_transform_edt(grown) > radius) | solid, solid))


def _with(grown: Mask, solid: Mask) -> Mask:
    """Return those pieces of the grown solid that hold some of the solid itself."""
    label, count = ndimage.label(grown)
    kept = np.zeros(count + 1, bool)
    kept[np.unique(label[solid])] = True
    return kept[label]


def thickened(solid: Mask, places: NDArray[np.int64], rings: int) -> Mask:
    """Return the solid with another layer of cells within `rings` cells of some places.

    Thin sheets, rods and pinches there get wider than the faces of a mesh are long; pinholes and narrow clefts close.
    Openings of hollows wider than clefts stay open. The border stays empty, and the solid must have no cavities.

    Parameters
    ----------
    solid : (nx, ny, nz) array of bool
    places : (n, 3) array of int
        Cells.
    rings : int

    Examples
    --------
    >>> sheet = np.zeros((9, 9, 7), bool)
    >>> sheet[2:7, 2:7, 3] = True
    >>> thick = thickened(sheet, np.array([[2, 2, 3]]), 2)
    >>> [int(thick[i, i].sum()) for i in (2, 4, 6)]
    [3, 3, 1]
    """
    near = np.zeros(solid.shape, bool)
    near[tuple(np.clip(places, 0, np.array(solid.shape) - 1).T)] = True
    near = ndimage.binary_dilation(near, _CORNERS, iterations=rings)
    out = solid | (near & ndimage.binary_dilation(solid, _CORNERS))
    for axis in range(3):
        side = np.moveaxis(out, axis, 0)
        side[0] = side[-1] = False
    return without_cavities(_opened(_with(out, solid), solid))


def _opened(grown: Mask, solid: Mask) -> Mask:
    """Return the grown solid less what was added around its wide hollows, where that has shut them."""
    while True:
        label, count = ndimage.label(~grown, _CORNERS)
        if count <= 1:
            return grown
        wide = np.unique(label[ndimage.binary_erosion(label > 0, _CORNERS, iterations=_WIDE)])
        hollows = np.isin(label, wide[(wide > 0) & (wide != label[0, 0, 0])])
        added = ndimage.label(grown & ~solid, _CORNERS)[0]
        plugs = np.unique(added[ndimage.binary_dilation(hollows, _CORNERS)])
        plugs = plugs[plugs > 0]
        if not len(plugs):
            return grown
        grown = grown & ~np.isin(added, plugs)


def pinched(solid: Mask) -> Mask:
    """Return the samples of every cube of the grid in which inside cells meet only along an edge or at a corner."""
    corner = {}
    for shift in product((0, 1), repeat=3):
        corner[shift] = solid[tuple(slice(s, n - 1 + s) for s, n in zip(shift, solid.shape, strict=True))]
    bad = np.zeros(tuple(n - 1 for n in solid.shape), bool)
    count = sum(c.astype(np.int8) for c in corner.values())
    for axis, side in product(range(3), (0, 1)):
        a, b, c, d = (corner[_placed(axis, side, p, q)] for p, q in ((0, 0), (1, 1), (0, 1), (1, 0)))
        bad |= (a == b) & (c == d) & (a != c)
    for p, q in product((0, 1), repeat=2):
        a, b = corner[0, p, q], corner[1, 1 - p, 1 - q]
        bad |= (a == b) & (count == np.where(a, 2, 6))
    out = np.zeros(solid.shape, bool)
    for shift in corner:
        out[tuple(slice(s, n - 1 + s) for s, n in zip(shift, solid.shape, strict=True))] |= bad
    return out


def _placed(axis: int, side: int, p: int, q: int) -> tuple[int, ...]:
    at = [p, q]
    at.insert(axis, side)
    return tuple(at)


def _joined(*, corners: bool) -> NDArray[np.int64]:
    """Return, for each cell of a 3x3x3 block, the others it is joined to inside the block, as `carve` wants it."""
    at = np.stack(np.unravel_index(np.arange(27), (3, 3, 3)), axis=1)
    apart = np.abs(at[:, None] - at[None])
    near = (apart.max(axis=2) == 1) if corners else (apart.sum(axis=2) == 1)
    if not corners:
        far = np.abs(at - 1).sum(axis=1) == 3
        near[:, far] = False
        near[far] = False
    out = np.full((27, 27), -1)
    for cell in range(27):
        others = [other for other in np.flatnonzero(near[cell]) if other != 13]
        out[cell, : len(others)] = others
    return out


_JOINED6 = _joined(corners=False)
_JOINED26 = _joined(corners=True)


def carved(solid: Mask, keep: Mask, rounds: int = 100) -> Mask:
    """Return the least solid between `keep` and `solid` that has the topology of `solid`, found by thinning.

    Cells are taken from the outside inwards, each only where it is simple (Bertrand and Malandain 1994), so that
    what remains beyond `keep` are membranes one cell thick where `keep` has tunnels and `solid` has none.
    """
    spare = solid & ~keep
    if not spare.any():
        return solid
    depth = ndimage.distance_transform_edt(solid)
    cells = np.argwhere(spare)
    cells = cells[np.argsort(depth[tuple(cells.T)], kind="stable")]
    out = solid.copy()
    _kernels_grid.carve(out, keep, cells, _JOINED6, _JOINED26, rounds)
    return out


def without_tunnels(solid: Mask, radius: float) -> tuple[Mask, int]:
    """Return the solid with the tunnels sealed that a ball of `radius` cells does not pass, and how many those were.

    The closing that leaves fewest, by the smallest radius up to the one given, is taken as the topology; everything it
    added is carved away again but membranes in the tunnels. Passages that close at a third of that radius stay
    filled, so that narrow pits (airways) do not become part of the skin.
    """
    before = genus(solid)
    if before == 0 or radius < 1:
        return solid, 0
    solid = np.pad(solid, int(radius) + 2)
    inner = tuple(slice(int(radius) + 2, -int(radius) - 2) for _ in range(3))
    best, fewest, used = solid, before, 0.0
    for part in (0.2, 0.4, 0.7, 1.0):
        trial = closed(solid, part * radius) if part * radius >= 1 else solid
        left = genus(trial)
        if left < fewest:
            best, fewest, used = trial, left, part * radius
        if fewest == 0:
            break
    keep = closed(solid, used / 3) if used >= 3 else solid
    out = carved(best, keep)
    return out[inner], before - genus(out)
