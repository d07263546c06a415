"""The result of a curvature estimator: values, directions, and where it failed."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.html import grid, pictured
from simplexmesh._base.vectors import cross


@dataclass(frozen=True, eq=False, repr=False)
class Curvature:
    """Curvatures at points of a surface, positive on a sphere seen from outside (normals point outward).

    Attributes
    ----------
    k1, k2 : (n,) array of float
        Principal curvatures, 1 / length, k1 >= k2 as signed numbers.
    mean, gauss : (n,) array of float
        H = (k1 + k2) / 2, 1 / length, and K = k1 k2, 1 / length squared.
    d1 : (n, 3) array of float or None
        Principal direction of k1, a unit tangent of arbitrary sign, arbitrary where k1 = k2. None from methods that
        estimate no directions.
    normals : (n, 3) array of float
        Unit normals of the estimate.
    failed : (n,) array of bool
        Where there is no estimate; every other array holds NaN there, and nowhere else.
    error : (n,) array of float or None
        Standard deviation of the error of `mean`, 1 / length, from methods that estimate it.
    method : str
        Name of the estimator.
    scale : (n,) array of float or None
        Radius of the neighborhoods, from methods that choose it.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> found = sm.curvature(sm.torus(24, 12).triangulated("dual"), method="sine")
    >>> found
    Curvature(sine, 288 vertices)
    >>> bool((found.k1 >= found.k2).all()), found.d1.shape
    (True, (288, 3))
    """

    k1: Array
    k2: Array
    mean: Array
    gauss: Array
    normals: Array
    failed: Mask
    d1: Array | None
    error: Array | None
    method: str
    scale: Array | None = None
    _surface: Any = field(default=None, repr=False)  # what they are of, if all of it

    def __repr__(self) -> str:
        n, failed = len(self.k1), int(self.failed.sum())
        failures = f", {failed:,} failed" if failed else ""
        return f"Curvature({self.method}, {n:,} vertices{failures})"

    def _repr_html_(self) -> str:
        """Return a picture of the mean curvature and a table of the distribution of the values, as notebooks show."""
        found = ~self.failed
        columns = ("5 %", "median", "95 %")
        rows = {
            name: tuple(f"{value:.4g}" for value in np.quantile(values[found], [0.05, 0.5, 0.95]))
            for name in ("k1", "k2", "mean", "gauss", "error", "scale")
            if (values := getattr(self, name)) is not None and found.any()
        }
        shown = () if self._surface is None or not found.any() else (self._surface,)
        return f"<p>{self!r}</p>" + pictured("mean curvature", grid(columns, rows), *shown, values=self.mean)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the surface with these values as arrays to a file in the format its name says, best .vtp.

        Raises
        ------
        ValueError
            Curvatures of chosen points only, which are no surface.
        """
        if self._surface is None:
            raise ValueError("curvature must be that of a whole surface to be saved, not of the points chosen by `at`")
        names = ("k1", "k2", "mean", "gauss", "d1", "error", "scale", "failed")
        self._surface.with_data(**{name: getattr(self, name) for name in names}).save(path)

    @cached_property
    def d2(self) -> Array | None:
        """(n, 3) array of float or None: principal direction of k2, the cross product of normal and `d1`."""
        return None if self.d1 is None else cross(self.normals, self.d1)

    @cached_property
    def curvedness(self) -> Array:
        """(n,) array of float: sqrt((k1^2 + k2^2) / 2), the magnitude of curvature (Koenderink 1990)."""
        out: Array = np.sqrt((self.k1**2 + self.k2**2) / 2)
        return out

    @cached_property
    def shape_index(self) -> Array:
        """(n,) array of float: 2/pi atan((k1 + k2) / (k1 - k2)): 1 cap, 1/2 ridge, 0 saddle, -1/2 rut, -1 cup.

        On planes, where it is undefined, 0.
        """
        out: Array = 2 / np.pi * np.arctan2(self.k1 + self.k2, self.k1 - self.k2)
        return out

    @cached_property
    def confidence(self) -> Array | None:
        """(n,) array of float or None: c^2 / (c^2 + error^2), c the curvedness; 1 if both are 0, 0 where failed."""
        if self.error is None:
            return None
        signal, noise = self.curvedness**2, self.error**2
        with np.errstate(invalid="ignore", divide="ignore"):
            out: Array = np.where(signal + noise > 0, signal / (signal + noise), 1.0)
        return np.where(self.failed, 0.0, out)

    def along(self, angle: ArrayLike, *, tilt: ArrayLike = 0.0) -> Array:
        """Return the curvature of a plane section of the surface at each vertex.

        A plane that contains the normal cuts k1 cos^2 + k2 sin^2 (Euler), an oblique plane that over the cosine of its
        tilt (Meusnier).

        Parameters
        ----------
        angle : float or (n,) array of float
            Of the section from `d1`, radians, from -pi to pi, counter-clockwise seen from outside.
        tilt : float or (n,) array of float
            Between the plane and the normal, radians, less than a right angle.

        Raises
        ------
        ValueError
            An angle beyond pi, a tilt of a right angle or more.
        """
        angles, tilts = (
            checks.array(name, value, (len(self.k1),) if np.ndim(value) else ())
            for name, value in (("angle", angle), ("tilt", tilt))
        )
        checks.angle("angle", float(np.abs(angles).max(initial=0.0)))
        if (np.abs(tilts) >= np.pi / 2).any():
            raise ValueError(f"tilt must be less than a right angle, not {np.abs(tilts).max():g}")
        out: Array = (self.k1 * np.cos(angles) ** 2 + self.k2 * np.sin(angles) ** 2) / np.cos(tilts)
        return out
