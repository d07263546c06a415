"""A start for the motion from a volume: the dual of a coarse isosurface, mended."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh import _check
from simplexmesh.data.volume import Volume
from simplexmesh.errors import TopologyError
from simplexmesh.motion.initial.budget import area_of, cell_for, edge_for
from simplexmesh.motion.initial.report import StartReport
from simplexmesh.motion.initial.sound import sound_mesh
from simplexmesh.motion.initial.start import Start
from simplexmesh.motion.initial.topology import pieces, without_cavities, without_tunnels

Array = NDArray[np.float64]

FEWEST = 20
_COARSEST, _FINEST = 1.5, 0.5
_MOST_CELLS, _MOST_CELLS_THIN = 3_000_000, 8_000_000
_ACROSS = 5
_MARGIN = 3
_BLUR, _LEFT = 0.6, 0.5


def start_from_volume(
    volume: Volume,
    level: float | None = None,
    label: int | None = None,
    vertices: int = 4000,
    *,
    components: str = "largest",
    tunnels: float | None = None,
) -> Start:
    """Return a closed mesh near the surface where the volume crosses `level`, or near the surface of a label.

    The volume is cropped, brought to cubic cells that suit the number of vertices, and cut at the level. Smaller
    pieces are dropped, cavities filled, and tunnels too narrow for the mesh sealed; what is left is triangulated,
    brought to one triangle per wanted vertex, and its dual taken. Where the body touches the border of the volume it
    is closed.

    Parameters
    ----------
    volume : Volume
    level : float, optional
        The body is where the volume is above it.
    label : int, optional
        The body is where the volume equals it. One of the two must be given.
    vertices : int
        Wanted number, at least 20.
    components : {'largest', 'all'}
        All means all that are large enough for 20 of the vertices.
    tunnels : float, optional
        Tunnels and passages narrower than this length are sealed; 0 keeps them all. When not given: 3 edges of the
        mesh, or 13 voxels (3 for a label) if that is more.

    Returns
    -------
    Start
        Mesh, in physical coordinates, and report.

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
    vertices = _check.integer("vertices", vertices, FEWEST)
    _check.choice("components", components, ["largest", "all"])
    native, first, left_out = _field(volume, level, label, components)
    body = without_cavities(native > 0)
    area = area_of(body, volume.spacing)
    cell = _cell(volume, body, area, vertices)
    field = _resampled(native, volume.spacing, cell, blurred=label is not None)
    smallest = max(30.0, FEWEST / vertices * np.count_nonzero(field > 0))
    solid, dropped = pieces(field > 0, components, smallest)
    if tunnels is None:
        voxel = float(np.prod(volume.spacing)) ** (1 / 3)
        tunnels = max(3 * edge_for(area, vertices), (13 if label is None else 3) * voxel)
    solid, sealed = without_tunnels(without_cavities(solid), min(tunnels / (2 * cell), max(solid.shape) / 8))
    T_world_cell = volume.T_world_index @ np.diag([*(cell / volume.spacing), 1.0])
    T_world_cell[:3, 3] += volume.T_world_index[:3, :3] @ first
    mesh, solid = sound_mesh(field, solid, T_world_cell, vertices)
    report = StartReport(solid.shape, cell, mesh.genus, mesh.n_components, sealed, max(left_out, dropped))
    return Start(mesh, report)


def _cell(volume: Volume, solid: NDArray[np.bool_], area: float, vertices: int) -> float:
    """Return the side of the cells: for twice the triangles needed, about a voxel, and not too many of them.

    Cells are finer, and may be more, where the body is thin: its mean thickness, that of a plate of its volume and
    area, is to be several of them.
    """
    voxel = float(np.prod(volume.spacing)) ** (1 / 3)
    thickness = 2 * np.count_nonzero(solid) * float(np.prod(volume.spacing)) / area
    wanted = min(cell_for(area, vertices), thickness / _ACROSS)
    cells = _MOST_CELLS if thickness > _ACROSS * _COARSEST * voxel else _MOST_CELLS_THIN
    most = voxel * (solid.size / cells) ** (1 / 3)
    return max(float(np.clip(wanted, _FINEST * voxel, _COARSEST * voxel)), most)


def _field(
    volume: Volume, level: float | None, label: int | None, components: str
) -> tuple[NDArray[np.float32], Array, int]:
    """Return the samples around the body, positive inside, the indices of the first, and how many pieces are left out.

    The border is outside.
    """
    inside, middle, contrast = _inside(volume, level, label)
    low, high = _box(inside)
    kept, dropped = pieces(inside[_cut(low, high, volume.shape)], components, corners=True)
    low_kept, high_kept = _box(kept)
    low, high = np.maximum(low, 0) + low_kept, np.maximum(low, 0) + high_kept
    cut = _cut(low, high, volume.shape)
    values = inside[cut] if label is not None else volume.values[cut]
    out = np.clip(values.astype(np.float32) - np.float32(middle), -contrast, contrast)
    pad = [(max(0, -a), max(0, b - n)) for a, b, n in zip(low, high, volume.shape, strict=True)]
    return np.pad(out, pad, constant_values=-contrast), low.astype(float), dropped


def _box(inside: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first indices of the box around what is inside, and those after its last, with a margin."""
    rows = [np.flatnonzero(inside.any(axis=tuple({0, 1, 2} - {axis}))) for axis in range(3)]
    return np.array([r[0] for r in rows]) - _MARGIN, np.array([r[-1] for r in rows]) + _MARGIN + 1


def _cut(low: NDArray[np.int64], high: NDArray[np.int64], shape: tuple[int, ...]) -> tuple[slice, ...]:
    return tuple(slice(max(0, int(a)), min(n, int(b))) for a, b, n in zip(low, high, shape, strict=True))


def _inside(volume: Volume, level: float | None, label: int | None) -> tuple[NDArray[np.bool_], float, float]:
    """Return where the body is, the value at its surface, and how far values may usefully lie from that one.

    Values are cut at equal distances above and below the level, so that smoothing does not draw the surface towards
    what is brightest.
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


def _resampled(native: NDArray[Any], spacing: Array, cell: float, *, blurred: bool) -> NDArray[np.float32]:
    """Return the field on cubic cells, its first sample in the same place, smoothed as much as those need.

    Less where the body is so thin that smoothing would take most of it.
    """
    factor = cell / spacing
    shape = tuple(np.ceil((np.array(native.shape) - 1) / factor).astype(int) + 2)
    wanted = np.count_nonzero(native > 0) / float(np.prod(factor))
    out: NDArray[np.float32]
    for blur in (_BLUR, _BLUR / 2, 0.0):
        sigma = blur * (factor.clip(1) if blurred else factor)
        smooth = ndimage.gaussian_filter(native, sigma, mode="nearest") if blur else native
        out = ndimage.affine_transform(
            smooth, factor, output_shape=shape, order=1, mode="constant", cval=float(native[0, 0, 0])
        )
        if np.count_nonzero(out > 0) > _LEFT * wanted:
            return out
    raise TopologyError(f"the body is too thin for a grid of cells {cell:.3g} wide; ask for more vertices")
