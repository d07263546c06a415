"""Initial mesh from a volume: the dual of a coarse isosurface with repaired topology."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh import _check
from simplexmesh.data.box import box_around, box_slices
from simplexmesh.data.volume import Volume
from simplexmesh.errors import TopologyError, warn
from simplexmesh.motion.initial.budget import cell_size, edge_length, surface_area
from simplexmesh.motion.initial.report import StartReport
from simplexmesh.motion.initial.solid_mesh import solid_mesh
from simplexmesh.motion.initial.start import Start
from simplexmesh.motion.initial.topology import pieces, without_cavities, without_tunnels

Array = NDArray[np.float64]

MIN_VERTICES = 20
_MAX_CELL, _MIN_CELL = 1.5, 0.5  # in voxels
_MAX_CELLS, _MAX_CELLS_THIN = 3_000_000, 8_000_000
_CELLS_ACROSS = 5
_FINER = (1.0, 0.6, 0.36)  # factors of the cells of solids that are otherwise lost
_MARGIN = 3
_BLUR, _MIN_VOLUME_LEFT = 0.6, 0.5


def start_from_volume(
    volume: Volume,
    level: float | None = None,
    label: int | None = None,
    vertices: int = 4000,
    *,
    components: str = "largest",
    tunnels: float | None = None,
) -> Start:
    """Return a closed mesh near the isosurface of a volume at `level`, or near the surface of a label.

    The volume is cropped, resampled to cubic cells that suit the number of vertices, and thresholded. Smaller
    components are dropped, cavities filled, and tunnels too narrow for the mesh sealed; the surface is triangulated,
    decimated to one triangle per wanted vertex, and dualized. Solids cut by the border of the volume are closed there.

    Parameters
    ----------
    volume : Volume
    level : float, optional
        The solid is where the volume is above it.
    label : int, optional
        The solid is where the volume equals it. Exactly one of the two must be given.
    vertices : int
        Number of vertices, at least 20.
    components : {'largest', 'all'}
        'all' keeps every component large enough for 20 of the vertices.
    tunnels : float, optional
        Tunnels and passages narrower than this length are sealed; 0 keeps all. By default 3 edge lengths of the mesh
        or 13 voxels (3 for a label), whichever is more.

    Returns
    -------
    Start
        Mesh in physical coordinates, and report.

    Raises
    ------
    ValueError
        Neither or both of level and label given, a level outside the range of the volume, an absent label.

    Examples
    --------
    >>> i, j, k = np.indices((40, 40, 40)) - 19.5
    >>> ball = Volume(15 - np.sqrt(i**2 + j**2 + k**2), spacing=0.5)
    >>> start = start_from_volume(ball, level=0.0, vertices=500)
    >>> start.mesh.n_vertices, start.mesh.genus
    (500, 0)
    """
    vertices = _check.integer("vertices", vertices, MIN_VERTICES)
    _check.choice("components", components, ["largest", "all"])
    native, first, left_out = _field(volume, level, label, components)
    body = without_cavities(native > 0)
    area = surface_area(body, volume.spacing)
    cell = _cell(volume, body, area, vertices)
    field, cell = _finely_resampled(native, volume.spacing, cell, binary=label is not None)
    smallest = max(30.0, MIN_VERTICES / vertices * np.count_nonzero(field > 0))
    solid, dropped = pieces(field > 0, components, smallest)
    if tunnels is None:
        voxel = float(np.prod(volume.spacing)) ** (1 / 3)
        tunnels = max(3 * edge_length(area, vertices), (13 if label is None else 3) * voxel)
    solid, sealed = without_tunnels(without_cavities(solid), min(tunnels / (2 * cell), max(solid.shape) / 8))
    T_world_cell = volume.T_world_index @ np.diag([*(cell / volume.spacing), 1.0])
    T_world_cell[:3, 3] += volume.T_world_index[:3, :3] @ first
    mesh, solid = solid_mesh(field, solid, T_world_cell, vertices)
    report = StartReport(solid.shape, cell, mesh.genus, mesh.n_components, sealed, max(left_out, dropped))
    return Start(mesh, report)


def _cell(volume: Volume, solid: NDArray[np.bool_], area: float, vertices: int) -> float:
    """Return the cell size: for twice the triangles needed, about a voxel, with a limit to the number of cells.

    Cells are smaller, and the limit is higher, for thin solids, whose mean thickness (that of a plate of the same
    volume and area) should be several cells.
    """
    voxel = float(np.prod(volume.spacing)) ** (1 / 3)
    thickness = 2 * np.count_nonzero(solid) * float(np.prod(volume.spacing)) / area
    wanted = min(cell_size(area, vertices), thickness / _CELLS_ACROSS)
    cells = _MAX_CELLS if thickness > _CELLS_ACROSS * _MAX_CELL * voxel else _MAX_CELLS_THIN
    most = voxel * (solid.size / cells) ** (1 / 3)
    return max(float(np.clip(wanted, _MIN_CELL * voxel, _MAX_CELL * voxel)), most)


def _field(
    volume: Volume, level: float | None, label: int | None, components: str
) -> tuple[NDArray[np.float32], Array, int]:
    """Return the samples around the solid, positive inside, the index of the first, and the components dropped.

    They are in a unit near the contrast. The outermost samples are outside.
    """
    inside, middle, contrast = _inside(volume, level, label)
    low, high = _box(inside)
    kept, dropped = pieces(inside[box_slices(low, high, volume.shape)], components, corners=True)
    low_kept, high_kept = _box(kept)
    low, high = np.maximum(low, 0) + low_kept, np.maximum(low, 0) + high_kept
    cut = box_slices(low, high, volume.shape)
    values = inside[cut] if label is not None else volume.values[cut]
    offset = values.astype(np.result_type(values, np.float32)) - middle  # in full precision: values may be large
    unit = 2.0 ** max(round(np.log2(contrast)), int(np.finfo(offset.dtype).minexp))  # for values beyond float32
    out = (np.clip(offset, -contrast, contrast) / unit).astype(np.float32)
    pad = [(max(0, -a), max(0, b - n)) for a, b, n in zip(low, high, volume.shape, strict=True)]
    return np.pad(out, pad, constant_values=-contrast / unit), low.astype(float), dropped


def _box(inside: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the bounding box of a non-empty mask, widened by a margin; it may extend beyond the grid."""
    box = box_around(inside)
    assert box is not None
    return box[0] - _MARGIN, box[1] + _MARGIN


def _inside(volume: Volume, level: float | None, label: int | None) -> tuple[NDArray[np.bool_], float, float]:
    """Return the mask of the solid, the value at its surface, and the contrast at which values are clipped.

    Values are clipped symmetrically about the level, so that smoothing does not shift the surface towards the brightest
    regions.
    """
    if level is not None and label is not None:
        raise ValueError("one of level and label must be given, not both")
    if label is not None:
        return np.asarray(volume.mask(label).values) > 0, 0.5, 0.5
    if level is None:
        raise ValueError("one of level and label must be given, got none")
    low, high = volume.range
    if not low < _check.number("level", level) < high:
        raise ValueError(f"level must be between {low:g} and {high:g}, the range of the volume, not {level:g}")
    return volume.values > level, level, min(level - low, high - level)


def _finely_resampled(
    native: NDArray[Any], spacing: Array, cell: float, *, binary: bool
) -> tuple[NDArray[np.float32], float]:
    """Return the field resampled to cells of this side, or of a smaller one that resolves a thin solid, and the side.

    Raises
    ------
    TopologyError
        The solid is lost on the finest grid tried.
    """
    for side in cell * np.array(_FINER):
        if side < cell and native.size * np.prod(spacing) > _MAX_CELLS_THIN * side**3:
            break
        field = _resampled(native, spacing, side, binary=binary)
        if field is not None:
            if binary and side < cell:
                warn("the solid is only a voxel or two thick: its model may be off by more than a voxel at its edges")
            return field, float(side)
        finest = side
    raise TopologyError(f"the solid is too thin for a grid of cells {finest:.3g} wide, the finest possible")


def _resampled(native: NDArray[Any], spacing: Array, cell: float, *, binary: bool) -> NDArray[np.float32] | None:
    """Return the field resampled to cubic cells, with the same first sample, after smoothing against aliasing.

    A `binary` field is smoothed by 0.6 voxels at least. It is smoothed less if a thin solid would lose half of its
    volume; None if it does even so.
    """
    factor = cell / spacing
    shape = tuple(np.ceil((np.array(native.shape) - 1) / factor).astype(int) + 2)
    wanted = np.count_nonzero(native > 0) / float(np.prod(factor))
    out: NDArray[np.float32]
    for blur in (_BLUR, _BLUR / 2, 0.0):
        sigma = blur * (factor.clip(1) if binary else factor)
        smooth = ndimage.gaussian_filter(native, sigma, mode="nearest") if blur else native
        out = ndimage.affine_transform(
            smooth, factor, output_shape=shape, order=1, mode="constant", cval=float(native[0, 0, 0])
        )
        if np.count_nonzero(out > 0) > _MIN_VOLUME_LEFT * wanted:
            return out
    return None
