"""Topology of a voxel solid: count, remove and seal components, cavities and tunnels.

A solid is a boolean grid with 6-connected inside and 26-connected outside, so that the digital topology is consistent
(Rosenfeld 1970). Its border is empty. Its Euler number is that of the cubical complex of inside cells and their
adjacent pairs, quadruples and octuples (Kong and Rosenfeld 1989).
"""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy import ndimage

from simplexmesh._base.arrays import Indices, Indices32, Mask
from simplexmesh.data.box import box_around, box_slices
from simplexmesh.motion.start import _kernels_topology
from simplexmesh.orientation import _kernels_grid

_CORNERS = np.ones((3, 3, 3))


def genus(solid: Mask) -> int:
    """Return the number of tunnels of a solid without cavities: the genus of its surface, summed over components."""
    return int(ndimage.label(solid)[1]) - euler(solid)


def euler(solid: Mask) -> int:
    """Return the Euler number of a solid: components - tunnels + cavities."""
    number = 0
    for corner in range(8):
        cells = solid
        for axis in range(3):
            if corner >> axis & 1:
                along = np.moveaxis(cells, axis, 0)
                cells = np.moveaxis(along[1:] & along[:-1], 0, axis)
        number += (-1) ** (corner.bit_count()) * int(np.count_nonzero(cells))
    return number


def pieces(
    solid: Mask, components: str = "largest", smallest: float = 0.0, *, corners: bool = False
) -> tuple[Mask, int]:
    """Return the largest component of a solid, or all of at least `smallest` cells, and the number of those dropped."""
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
    """Return the solid with its cavities filled."""
    return solid | (_cavities(solid) > 0)


def _cavities(solid: Mask) -> Indices32:
    """Return labels of the cavities: what a flood from around the grid leaves, by components that do not touch it."""
    filled, label = np.pad(solid, 1), np.zeros(solid.shape, np.int32)
    _kernels_grid.flood(filled)
    filled = filled[1:-1, 1:-1, 1:-1]
    box = box_around(~filled)
    if box is not None:
        part = box_slices(*box, solid.shape, margin=1)
        found, _ = ndimage.label(~filled[part], _CORNERS)
        found[np.isin(found, found[_layered((filled & ~solid)[part])])] = 0
        label[part] = found
    return label


def closed(solid: Mask, radius: float) -> Mask:
    """Return the morphological closing of a solid by a ball of `radius` cells, cavities filled."""
    shrunk = ~within(~within(solid, radius), radius)
    return without_cavities(_components_containing(shrunk | solid, solid))


def within(cells: Mask, radius: float) -> Mask:
    """Return the cells within a distance `radius`, in cells, of true ones: far faster than a distance transform."""
    limit, out = int(radius * radius + 1e-9), np.zeros(cells.shape, bool)
    squares, filled = np.full(cells.shape, limit + 1, np.int32), np.zeros(cells.shape[:2], bool)
    _kernels_topology.fill_squares(len(cells), cells, limit, squares, filled)
    _kernels_topology.fill_within(len(cells), squares, filled, limit, out)
    return out


def _layered(cells: Mask, layers: int = 1) -> Mask:
    """Return a mask with layers of cells added, also across edges and corners; slices take a tenth of SciPy's time."""
    out = cells.copy()
    for axis in range(3):
        for _ in range(layers):
            side, before = np.moveaxis(out, axis, 0), np.moveaxis(out.copy(), axis, 0)
            side[1:] |= before[:-1]
            side[:-1] |= before[1:]
    return out


def _components_containing(grown: Mask, solid: Mask) -> Mask:
    """Return the components of a grown solid that contain cells of the original one."""
    label, count = ndimage.label(grown)
    kept = np.zeros(count + 1, bool)
    kept[np.unique(label[solid])] = True
    return kept[label]


def thickened(solid: Mask, places: Indices, rings: int) -> Mask:
    """Return a solid grown by a layer near places (n, 3): pinholes and clefts close, wider hollows stay open."""
    near = np.zeros(solid.shape, bool)
    near[tuple(np.clip(places, 0, np.array(solid.shape) - 1).T)] = True
    out = solid | (_layered(near, rings) & _layered(solid))
    for axis in range(3):
        side = np.moveaxis(out, axis, 0)
        side[0] = side[-1] = False
    return without_cavities(_reopened(_components_containing(out, solid), solid))


def _reopened(grown: Mask, solid: Mask) -> Mask:
    """Return the grown solid without the added cells that closed off hollows that outlast two erosions."""
    while True:
        label = _cavities(grown)
        if not label.any():
            return grown
        wide = np.unique(label[(label > 0) & ~_layered(grown, 2)])
        hollows = np.isin(label, wide)
        added = ndimage.label(grown & ~solid, _CORNERS)[0]
        plugs = np.unique(added[_layered(hollows)])
        plugs = plugs[plugs > 0]
        if not len(plugs):
            return grown
        grown = grown & ~np.isin(added, plugs)


def pinched(solid: Mask) -> Mask:
    """Return the samples of all grid cubes in which inside cells meet only along an edge or at a corner."""
    count = solid.astype(np.int8)
    for axis in range(3):
        layers = np.moveaxis(count, axis, 0)
        count = np.moveaxis(layers[1:] + layers[:-1], 0, axis)
    cubes = np.stack(np.nonzero((count > 1) & (count < 7)))
    places = cubes[:, None] + np.array(list(product((0, 1), repeat=3))).T[:, :, None]
    corner = solid[tuple(places)].reshape(2, 2, 2, -1)
    bad = np.zeros(cubes.shape[1], bool)
    for axis, end in product(range(3), (0, 1)):
        (a, c), (d, b) = np.moveaxis(corner, axis, 0)[end]
        bad |= (a == b) & (c == d) & (a != c)
    for p, q in product((0, 1), repeat=2):
        a, b = corner[0, p, q], corner[1, 1 - p, 1 - q]
        bad |= (a == b) & (count[tuple(cubes)] == np.where(a, 2, 6))
    out = np.zeros(solid.shape, bool)
    out[tuple(places[:, :, bad])] = True
    return out


def _block_adjacency(*, corners: bool) -> Indices:
    """Return the adjacency lists (27, 27) of a 3x3x3 block without its center, padded by -1, for the `thin` kernel."""
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


_ADJACENCY6 = _block_adjacency(corners=False)


_ADJACENCY26 = _block_adjacency(corners=True)


def thinned(solid: Mask, keep: Mask, rounds: int = 100) -> Mask:
    """Return `solid` thinned towards `keep` by removal of simple cells (Bertrand and Malandain 1994), from outside."""
    spare = solid & ~keep
    if not spare.any():
        return solid
    depth = ndimage.distance_transform_edt(solid)
    cells = np.argwhere(spare)
    cells = cells[np.argsort(depth[tuple(cells.T)], kind="stable")]
    out = solid.copy()
    _kernels_topology.thin(out, keep, cells, _ADJACENCY6, _ADJACENCY26, rounds)
    return out


def without_tunnels(solid: Mask, radius: float) -> tuple[Mask, int]:
    """Return the solid with the tunnels sealed that a ball of `radius` cells does not pass, and their number.

    The smallest closing that leaves the fewest tunnels determines the topology; what it added is thinned to membranes
    across them. What closes at a third of its radius stays filled: narrow pits (airways) are no part of the surface.
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
    out = thinned(best, keep)
    return out[inner], before - genus(out)
