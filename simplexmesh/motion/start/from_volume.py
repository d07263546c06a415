"""Initial mesh from a volume: the dual of a coarse isosurface with repaired topology.

The volume is cropped, resampled to cubic cells that suit the number of vertices, and thresholded. Smaller components
are dropped, cavities filled, and tunnels too narrow for the mesh sealed. Solids cut by the border of the volume are
closed there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import TopologyError, warn
from simplexmesh.data.box import box_around, box_slices
from simplexmesh.data.volume import Volume
from simplexmesh.motion.start.report import Start, StartReport
from simplexmesh.motion.start.solid_mesh import FEWEST, cell_size, edge_length, solid_mesh, surface_area
from simplexmesh.motion.start.topology import pieces, without_cavities, without_tunnels

MOST_CELLS, MOST_CELLS_THIN = 3_000_000, 8_000_000
"""Grid cells, also for thin solids: time and memory against detail."""

CELLS_ACROSS = 5
"""Cells wanted across the mean thickness of a solid."""

FINEST = 0.4
"""Finest cell, in edges of the mesh: details beyond its resolution make it intersect itself in thin solids."""

LEAST_FILLED = 0.05
"""Cavities from which a warning is given, as a share of the solid: noise makes small ones, a pulp is 4 %."""

_CORNERS = np.ones((3, 3, 3))

BLUR = 0.6
"""Smoothing, in cells, against steps of the resampled surface; thin solids take less."""


def start_from_volume(
    volume: Volume,
    level: float | None = None,
    label: int | None = None,
    vertices: int = 4000,
    *,
    components: str = "largest",
    tunnels: float | None = None,
) -> Start:
    """Return a closed mesh near an isosurface, its object above it, or near a label; narrower `tunnels` are sealed."""
    native, first, left_out = _field(volume, level, label, components, 0.5 * FEWEST / vertices)
    body = without_cavities(native > 0)
    cavities = body & (native <= 0)
    filled = np.count_nonzero(cavities) / np.count_nonzero(native > 0)
    if filled >= LEAST_FILLED:
        name = "object" if label is None else "label"
        warn(f"filled cavities inside of the {name}, of {filled:.0%} of its volume: a model is an outer surface")
    native[cavities] = native.max()  # before a thin wall opens on other cells
    area = surface_area(body, volume.spacing)
    cell = _cell(volume, body, area, vertices)
    field, cell = _finely_resampled(native, volume.spacing, cell, binary=label is not None)
    smallest = max(30.0, FEWEST / vertices * np.count_nonzero(field > 0))
    solid, dropped = pieces(field > 0, components, smallest)
    if tunnels is None:
        voxel = float(np.prod(volume.spacing)) ** (1 / 3)
        tunnels = max(3 * edge_length(area, vertices), 3 * voxel)
    solid, sealed = without_tunnels(without_cavities(solid), min(tunnels / (2 * cell), max(solid.shape) / 8))
    T_world_cell = volume.T_world_index @ np.diag([*(cell / volume.spacing), 1.0])
    T_world_cell[:3, 3] += volume.T_world_index[:3, :3] @ first
    mesh, solid = solid_mesh(field, solid, T_world_cell, vertices)
    report = StartReport(solid.shape, cell, mesh.genus, mesh.n_components, sealed, max(left_out, dropped))
    if components != "all":
        return Start(mesh, report)
    whole = _inside(volume, level, label)[0]
    missing, count = _missing(whole, solid, first, cell / volume.spacing)
    share = np.count_nonzero(missing) / np.count_nonzero(whole)
    report = replace(report, components_dropped=count, share_dropped=share)
    return Start(mesh, report, left_out=missing if count else None)


def _missing(inside: Mask, solid: Mask, first: Array, factor: Array) -> tuple[Mask, int]:
    """Return the samples, and number, of pieces of which a solid, with cells of `factor` from `first`, has nothing."""
    near = ndimage.binary_dilation(np.pad(solid, 2))
    sides = zip(inside.shape, near.shape, first, factor, strict=True)
    at = [np.rint((np.arange(n) - low) / step).astype(int).clip(-2, m - 3) + 2 for n, m, low, step in sides]
    label, count = ndimage.label(inside, _CORNERS)
    kept = np.zeros(count + 1, bool)
    kept[0] = kept[label[near[np.ix_(*at)]]] = True
    return ~kept[label], int(np.count_nonzero(~kept))


def _cell(volume: Volume, solid: Mask, area: float, vertices: int) -> float:
    """Return the cell size: for twice the triangles needed, less if thin, about a voxel, and not too many."""
    voxel = float(np.prod(volume.spacing)) ** (1 / 3)
    thickness = 2 * np.count_nonzero(solid) * float(np.prod(volume.spacing)) / area
    wanted = min(cell_size(area, vertices), max(thickness / CELLS_ACROSS, FINEST * edge_length(area, vertices)))
    cells = MOST_CELLS if thickness > CELLS_ACROSS * 1.5 * voxel else MOST_CELLS_THIN
    most = voxel * (solid.size / cells) ** (1 / 3)
    return max(float(np.clip(wanted, 0.5 * voxel, 1.5 * voxel)), most)


def _field(
    volume: Volume, level: float | None, label: int | None, components: str, smallest: float
) -> tuple[NDArray[np.float32], Array, int]:
    """Return the samples around the solid, positive inside, the index of the first, and the components dropped."""
    inside, middle, contrast = _inside(volume, level, label)
    low, high = _box(inside)
    part = inside[box_slices(low, high, volume.shape)]
    kept, dropped = pieces(part, components, smallest * np.count_nonzero(part), corners=True)
    low_kept, high_kept = _box(kept)
    low, high = np.maximum(low, 0) + low_kept, np.maximum(low, 0) + high_kept
    cut = box_slices(low, high, volume.shape)
    values = inside[cut] if label is not None else volume.values[cut]
    offset = values.astype(np.result_type(values, np.float32)) - middle  # in full precision: values may be large
    unit = 2.0 ** max(round(np.log2(contrast)), int(np.finfo(offset.dtype).minexp))  # for values beyond float32
    out = (np.clip(offset, -contrast, contrast) / unit).astype(np.float32)
    pad = [(max(0, -a), max(0, b - n)) for a, b, n in zip(low, high, volume.shape, strict=True)]
    return np.pad(out, pad, constant_values=-contrast / unit), low.astype(float), dropped


def _box(inside: Mask) -> tuple[Indices, Indices]:
    """Return the bounding box of a non-empty mask, widened by a margin; it may extend beyond the grid."""
    box = box_around(inside)
    assert box is not None
    return box[0] - 3, box[1] + 3


def _inside(volume: Volume, level: float | None, label: int | None) -> tuple[Mask, float, float]:
    """Return the mask of the solid, the value at its surface, and the contrast to clip at, the same on both sides."""
    if level is None:
        assert label is not None
        return np.asarray(volume.mask(label).values) > 0, 0.5, 0.5
    low, high = volume.range
    contrast = min(level - low, high - level)  # else smoothing would shift the surface towards the brightest regions
    return volume.values > level, level, contrast


def _finely_resampled(
    native: NDArray[Any], spacing: Array, cell: float, *, binary: bool
) -> tuple[NDArray[np.float32], float]:
    """Return the field resampled to cells of this side, or a smaller one for a thin solid, and the side."""
    for side in cell * np.array([1.0, 0.6, 0.36]):
        if side < cell and native.size * np.prod(spacing) > MOST_CELLS_THIN * side**3:
            break
        field = _resampled(native, spacing, side, binary=binary)
        if field is not None:
            if binary and side < cell:
                warn("the solid is only a voxel or two thick: its model may be off by more than a voxel at its edges")
            return field, float(side)
        finest = side
    raise TopologyError(f"the solid is too thin for a grid of cells {finest:.3g} wide, the finest possible")


def _resampled(native: NDArray[Any], spacing: Array, cell: float, *, binary: bool) -> NDArray[np.float32] | None:
    """Return the field on cubic cells, smoothed less where half of its volume would be lost; None if it is even so."""
    factor = cell / spacing
    shape = tuple(np.ceil((np.array(native.shape) - 1) / factor).astype(int) + 2)
    wanted = np.count_nonzero(native > 0) / float(np.prod(factor))
    out: NDArray[np.float32]
    for blur in (BLUR, BLUR / 2, 0.0):
        sigma = blur * (factor.clip(1) if binary else factor)
        smooth = ndimage.gaussian_filter(native, sigma, mode="nearest") if blur else native
        out = ndimage.affine_transform(
            smooth, factor, output_shape=shape, order=1, mode="constant", cval=float(native.min())
        )
        if np.count_nonzero(out > 0) > 0.5 * wanted:
            return out
    return None
