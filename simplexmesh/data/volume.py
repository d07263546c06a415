"""A volume: samples on a regular grid in physical space."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.html import card
from simplexmesh._base.units import InUnits, unit_or_none
from simplexmesh.data.labels import MOST_LABELS, few_whole_numbers, looks_like_labels, slabs
from simplexmesh.data.poses import rigid

MAX_SAMPLES = 1e11
"""Spacings that would give more samples are refused by `Volume.resampled`."""


@dataclass(frozen=True, eq=False, repr=False)
class Volume(InUnits):
    """Samples on a regular grid in physical space.

    The sample `values[i, j, k]` is at ``origin + direction @ (spacing * [i, j, k])``, the center of its voxel.

    Parameters
    ----------
    values : (nx, ny, nz) array of int or float
        The samples, at least two along each axis, all finite. The type is kept (bool becomes uint8, half floats
        become single). They are stored read-only in Fortran order, as in the files; a read-only Fortran-contiguous
        array is used without a copy.
    spacing : (3,) array of float or float
        Distance between samples along i, j and k, in the unit of length of the data; positive.
    origin : (3,) array of float
        Position of sample (0, 0, 0).
    direction : (3, 3) array of float, optional
        Orthonormal unit vectors of the axes i, j, k as columns; the identity by default. Left-handed axes
        (determinant -1), which occur in medical images, are allowed.
    unit : str, optional
        Unit of length of spacing and origin: "nm", "um", "mm", "cm", "m", "km", "in" or "ft".

    Raises
    ------
    ValueError
        Wrong shape, fewer than two samples along an axis, NaN or infinite values, spacing not positive, axes not
        perpendicular.
    TypeError
        Samples that are not real numbers.

    Examples
    --------
    >>> volume = Volume(np.zeros((4, 5, 6)), spacing=(1, 1, 2.5), origin=(10, 0, 0))
    >>> volume.to_world([3, 0, 2])
    array([13.,  0.,  5.])
    >>> volume
    Volume(shape=(4, 5, 6), float64, spacing=(1, 1, 2.5), range=(0, 0))
    """

    _named: ClassVar[str] = "Volume, of which reconstruct makes a surface"

    values: NDArray[Any]
    spacing: Array = (1.0, 1.0, 1.0)  # type: ignore[assignment]
    origin: Array = (0.0, 0.0, 0.0)  # type: ignore[assignment]
    direction: Array = None  # type: ignore[assignment]
    unit: str | None = None

    def __post_init__(self) -> None:
        spacing = _per_axis(self.spacing)
        fields = {
            "values": _samples(self.values),
            "spacing": checks.frozen(spacing),
            "origin": checks.frozen(checks.array("origin", self.origin, (3,))),
            "direction": _axes(self.direction),
            "unit": unit_or_none("unit", self.unit),
        }
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        spacing = ", ".join(f"{s:g}" for s in self.spacing)
        low, high = self.range
        return f"Volume(shape={self.shape}, {self.values.dtype}, spacing=({spacing}), range=({low:g}, {high:g}))"

    def _repr_html_(self) -> str:
        """Return a table of what matters, as notebooks show."""
        size = " x ".join(f"{side:.4g}" for side in np.ptp(self.bounds, axis=0))
        facts = {"shape": " x ".join(map(str, self.shape)), "size": f"{size} {self.unit or ''}".strip()}
        spacing, (low, high) = ", ".join(f"{step:g}" for step in self.spacing), self.range
        return card("Volume", facts | {"spacing": spacing, "values": f"{self.values.dtype}, {low:g} to {high:g}"})

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of samples along i, j and k."""
        nx, ny, nz = self.values.shape
        return nx, ny, nz

    @cached_property
    def range(self) -> tuple[float, float]:
        """Smallest and largest sample."""
        return float(self.values.min()), float(self.values.max())

    @cached_property
    def T_world_index(self) -> Array:
        """(4, 4) array of float: maps indices (i, j, k, 1) to physical coordinates (x, y, z, 1)."""
        T = np.eye(4)
        T[:3, :3] = self.direction * self.spacing
        T[:3, 3] = self.origin
        return checks.frozen(T)

    def to_world(self, ijk: ArrayLike) -> Array:
        """Return the physical coordinates of (..., 3) continuous indices."""
        T = self.T_world_index
        return _triples("ijk", ijk) @ T[:3, :3].T + T[:3, 3]

    def to_index(self, xyz: ArrayLike) -> Array:
        """Return the continuous indices of (..., 3) physical coordinates.

        Examples
        --------
        >>> Volume(np.zeros((3, 3, 3)), spacing=2).to_index([4, 0, 1])
        array([2. , 0. , 0.5])
        """
        T = np.linalg.inv(self.T_world_index)
        return _triples("xyz", xyz) @ T[:3, :3].T + T[:3, 3]

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) array of float: lowest and highest physical coordinates of the samples."""
        corners = self.to_world(np.stack(np.meshgrid(*[(0, n - 1) for n in self.shape]), axis=-1).reshape(-1, 3))
        return checks.frozen(np.stack([corners.min(axis=0), corners.max(axis=0)]))

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the grid, first sample to last."""
        return float(np.linalg.norm(self.spacing * (np.array(self.shape) - 1)))

    @cached_property
    def is_labels(self) -> bool:
        """Whether the samples look like labels (region numbers) rather than intensities.

        They do if all are whole numbers with at most 64 distinct values and, beyond two values, more than half of the
        pairs adjacent along i are equal, those within the background (the most frequent value) excluded. On the frog
        69 to 86 % of those pairs are equal, on 8-bit medical images 2 to 13 %.
        """
        return looks_like_labels(self.values)

    def labels(self) -> tuple[int, ...]:
        """Return the labels present, in increasing order.

        Raises
        ------
        ValueError
            The volume holds intensities.
        """
        if not self.is_labels:
            raise ValueError(
                f"volume holds intensities, not labels (at most {MOST_LABELS} whole numbers in regions); {self!r}"
            )
        return tuple(sorted(int(label) for label in few_whole_numbers(self.values) or ()))

    def mask(self, label: int) -> Volume:
        """Return the binary volume of a label: 1 where this volume equals it, 0 elsewhere.

        Raises
        ------
        ValueError
            No sample has that label, or the volume holds intensities or a single value.
        TypeError
            The label is not a number.
        """
        checks.number("label", label)
        inside = self.values == label
        low, high = self.range
        any_number = self.values.size  # of labels, as this one was asked for
        if low < high and not self.is_labels and not looks_like_labels(self.values, any_number):
            found = f"volume holds intensities ({low:g} to {high:g}), not labels"
            raise ValueError(f"{found}; give level (--level), not label {label!r}")
        if not inside.any():
            if low == high:
                raise ValueError(f"volume has the value {low:g} everywhere, label {label!r} is not in it")
            present = f"; present are {list(self.labels())}" if self.is_labels else ""
            raise ValueError(f"label must be present in the volume, {label!r} is not{present}")
        return self._with_values(inside)

    def transformed(self, T_target_source: ArrayLike) -> Volume:
        """Return the volume in the target frame of a (4, 4) rotation and translation: the samples stay, the grid moves.

        Examples
        --------
        >>> T = np.eye(4)
        >>> T[:3, 3] = 1, 2, 3
        >>> Volume(np.zeros((3, 3, 3))).transformed(T).origin
        array([1., 2., 3.])
        """
        T = rigid("T_target_source", T_target_source)
        return replace(self, origin=T[:3, :3] @ self.origin + T[:3, 3], direction=T[:3, :3] @ self.direction)

    def scaled(self, factor: float) -> Volume:
        """Return the volume with spacing and origin multiplied by a positive factor; samples and `unit` stay."""
        factor = checks.number("factor", factor, 0.0, open_low=True)
        return replace(self, spacing=factor * self.spacing, origin=factor * self.origin)

    def smoothed(self, sigma: float) -> Volume:
        """Return the volume smoothed by a Gaussian.

        Parameters
        ----------
        sigma : float
            Standard deviation in the unit of length of the data, the same in all physical directions.

        Returns
        -------
        Volume
            Single precision (double when this one is).
        """
        from scipy import ndimage

        sigma = checks.number("sigma", sigma, 0.0, self.diagonal)
        out: NDArray[Any] = np.zeros(self.shape, dtype=self._float_type, order="F")
        ndimage.gaussian_filter(self.values, sigma / self.spacing, output=out, mode="nearest")
        return self._with_values(out)

    def resampled(self, spacing: ArrayLike) -> Volume:
        """Return the volume resampled to another spacing, with the same center.

        Along axes that get coarser by a factor, the volume is first smoothed against aliasing by a Gaussian of standard
        deviation (factor - 1) / 2 samples; interpolation is linear.

        Parameters
        ----------
        spacing : float or (3,) array of float
            The new spacing, in the unit of length of the data.

        Returns
        -------
        Volume
            Same axes, single precision (double when this one is). The grid reaches to the first and last sample of
            this one, or less than one new spacing beyond.
        """
        from scipy import ndimage

        wanted = _per_axis(spacing)
        factor = wanted / self.spacing
        extent = np.array(self.shape) - 1
        counts = np.clip(np.ceil(extent / factor - 1e-9) + 1, 2, 1e30)
        if counts.prod() > MAX_SAMPLES:
            raise ValueError(f"spacing must give at most {MAX_SAMPLES:.2g} samples, not {counts.prod():.2g}")
        shape = counts.astype(int)
        start = (extent - factor * (shape - 1)) / 2
        fine: NDArray[Any] = self.values.astype(self._float_type, copy=False)
        if (factor > 1).any():
            sigmas = np.clip((factor - 1) / 2, 0, 2 * extent)  # a wider kernel would only see the border
            fine = ndimage.gaussian_filter(fine, sigmas, mode="nearest")
        out: NDArray[Any] = np.zeros(shape, dtype=self._float_type, order="F")
        ndimage.affine_transform(
            fine, factor, offset=start, output=out, output_shape=tuple(shape), order=1, mode="nearest"
        )
        out.setflags(write=False)
        return replace(self, values=out, spacing=wanted, origin=self.to_world(start))

    @property
    def _float_type(self) -> type:
        return np.float64 if self.values.dtype == np.float64 else np.float32

    def _with_values(self, values: NDArray[Any]) -> Volume:
        values.setflags(write=False)
        return replace(self, values=values)


def _per_axis(spacing: ArrayLike) -> Array:
    one = checks.any_array("spacing", spacing).ndim == 0
    out = np.full(3, checks.number("spacing", spacing)) if one else spacing
    out = checks.array("spacing", out, (3,))
    if (out <= 0).any():
        raise ValueError(f"spacing must be positive along every axis, not {tuple(out.tolist())}")
    return out


def _triples(name: str, value: ArrayLike) -> Array:
    """Return an array of shape (..., 3), checked."""
    rows = checks.any_array(name, value)
    return checks.array(name, rows, (*rows.shape[:-1], 3))


def _samples(values: ArrayLike) -> NDArray[Any]:
    out = checks.any_array("values", values)
    if out.dtype.kind not in "biuf":
        raise TypeError(
            f"values must be real numbers of shape (nx, ny, nz), not {type(values).__name__} of {out.dtype}"
        )
    if out.ndim != 3:
        raise ValueError(f"values must have shape (nx, ny, nz), not {out.shape}")
    if min(out.shape) < 2:
        raise ValueError(f"values must have at least 2 samples along each axis, not shape {out.shape}")
    if out.dtype.kind == "f":
        bad = sum(int(slab.size - np.count_nonzero(np.isfinite(slab))) for slab in slabs(out))
        if bad:
            raise ValueError(f"values must be finite; {bad} of {out.size} are NaN or infinite")
    if out.dtype == bool:
        out = out.view(np.uint8)
    elif out.dtype in (np.float16, np.longdouble):
        out = out.astype(np.float32 if out.dtype == np.float16 else np.float64)
    wanted = out.dtype.newbyteorder("=")
    if out.flags.writeable or not out.flags.f_contiguous or out.dtype != wanted:
        out = np.array(out, dtype=wanted, order="F", copy=True)
        out.setflags(write=False)
    return out


def _axes(direction: ArrayLike | None) -> Array:
    if direction is None:
        return checks.frozen(np.eye(3))
    out = checks.array("direction", direction, (3, 3))
    off = np.abs(out.T @ out - np.eye(3)).max()
    if off > 1e-3:
        raise ValueError(f"direction must have perpendicular columns of length one; they are off by {off:.2g}")
    return checks.frozen(out)
