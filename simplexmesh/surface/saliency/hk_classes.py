"""Eight classes of surface by the signs of mean and Gaussian curvature (Besl and Jain 1986)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.saliency.fields import known_curvature
from simplexmesh.surface.saliency.smoothed_curvature import SmoothedCurvature, shrunk, smoothed_curvature
from simplexmesh.surface.sampled_surface import as_sampled_surface

UNKNOWN, PEAK, RIDGE, SADDLE_RIDGE, FLAT, MINIMAL, SADDLE_VALLEY, VALLEY, PIT = range(9)

NAMES = ("unknown", "peak", "ridge", "saddle ridge", "flat", "minimal", "saddle valley", "valley", "pit")
"""By class number: unknown, H > 0, H = 0, H < 0."""

COLORS = (
    "#8c8c8c", "#c8322b", "#ee8a4a", "#f3cf7a", "#cfcfc6", "#9ccf8d", "#8fd0dd", "#4a8fd0", "#3a3f9e",
)  # fmt: skip
"""Color of each class: red for H > 0, blue for H < 0."""

SIGNIFICANCE = 1.5
"""Tolerance of a zero curvature, in standard deviations of its error."""

NOT_FLAT = 2.3
"""Least sqrt(k1^2 + k2^2) of a surface that is not flat, in tolerances of H."""

MIN_CURVATURE = 0.3
"""Least tolerance of H, times the diagonal: a surface with a radius of three diagonals is flat."""


@dataclass(frozen=True, eq=False, repr=False)
class HKClasses:
    """Class of the surface at each vertex, by the signs of H and K.

    ===================  =====  ======  =============
    .                    K > 0  K = 0   K < 0
    ===================  =====  ======  =============
    H > 0, outward       peak   ridge   saddle ridge
    H = 0                .      flat    minimal
    H < 0, inward        pit    valley  saddle valley
    ===================  =====  ======  =============

    Attributes
    ----------
    labels : (n,) array of int
        Index in `names`; 0 where curvature is unknown.
    tolerance_mean, tolerance_gauss : (n,) array of float
        Tolerances within which H, in 1 / length, and K, in 1 / length squared, were taken as zero.
    names, colors : tuple of str
        Names and colors of the classes.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring = sm.torus(60, 24).triangulated("dual")
    >>> found = sm.hk_classes(ring, curvature=sm.curvature(ring, "sine"))
    >>> found.names[found.labels[ring.vertices[:, 0].argmax()]]
    'peak'
    """

    labels: NDArray[np.int8]
    tolerance_mean: Array
    tolerance_gauss: Array
    names: tuple[str, ...] = NAMES
    colors: tuple[str, ...] = COLORS

    def __repr__(self) -> str:
        return f"HKClasses({', '.join(f'{name} {count:,}' for name, count in self.counts.items())})"

    @property
    def counts(self) -> dict[str, int]:
        """Number of vertices of each class present."""
        count = np.bincount(self.labels, minlength=len(NAMES))
        return {name: int(k) for name, k in zip(NAMES, count, strict=True) if k}


def hk_classes(
    surface: Any,
    *,
    curvature: Curvature | None = None,
    scale: float | None = None,
    tolerance_mean: float | ArrayLike | None = None,
    tolerance_gauss: float | ArrayLike | None = None,
) -> HKClasses:
    """Classify a surface at each vertex by the signs of H and K.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        The surface.
    curvature : Curvature, optional
        Curvature of the surface, if known; otherwise it is measured.
    scale : float, optional
        Width of the window over which H and K are smoothed first, in the surface's unit of length; 0 for none. By
        default they are shrunk toward their averages over the smallest window of `saliency`, 0.6 % of the diagonal or
        1.5 edges, as far as the estimated error requires: not at all on clean meshes, fully on noisy ones. Where the
        result is zero the averages are tested too.
    tolerance_mean, tolerance_gauss : float or (n,) array of float, optional
        Tolerances within which H, in 1 / length, and K, in 1 / length squared, count as zero. By default 1.5 standard
        deviations of the error that remains after smoothing, from the method's error, bounded by differences between
        neighbors, or from these alone; of H at least 0.3 over the diagonal. That of K follows from
        dK = sqrt(k1^2 + k2^2) dk + dk^2.

    Returns
    -------
    HKClasses

    Raises
    ------
    ValueError, TypeError
        Not a surface, a negative tolerance or scale.

    Notes
    -----
    Where H and K are within their tolerances, but k1 and k2 together are not, as near a saddle with large errors, the
    nearest of ridge, minimal and valley is taken instead of flat, unless tolerances are given.

    K is at most H squared: where K is positive while H is within its tolerance, the sign of H decides, peak or pit.

    References
    ----------
    P. Besl, R. Jain, *Invariant surface characteristics for 3D object recognition in range images*, 1986; H has the
    other sign there.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> tube = sm.cylinder(48, 40, height=4).triangulated("dual")
    >>> curved = sm.curvature(tube, "sine", neighborhood=sm.rings(2))
    >>> sm.hk_classes(tube, curvature=curved, tolerance_gauss=0.05).counts["ridge"] > 1500
    True
    """
    samples = as_sampled_surface(surface)
    diffusion = Diffusion(samples)
    known = known_curvature(samples, curvature)
    estimates: tuple[SmoothedCurvature, ...]
    if scale is None:
        estimates = shrunk(diffusion, known)
    else:
        estimates = (smoothed_curvature(diffusion, known, checks.number("scale", scale, 0.0)),)
    min_error = MIN_CURVATURE / diffusion.diagonal if diffusion.diagonal > 0 else 0.0
    mean, gauss, tolerance, tolerance_k = _combined(
        [_with_tolerances(each, min_error, tolerance_mean, tolerance_gauss) for each in estimates]
    )
    labels = signs(mean, gauss, tolerance, tolerance_k)
    if tolerance_mean is None and tolerance_gauss is None:
        labels = np.where(labels == FLAT, bent_class(mean, gauss, tolerance), labels)
    labels = np.where(known.failed, UNKNOWN, labels)
    return HKClasses(
        checks.frozen(labels, np.int8),
        checks.frozen(tolerance),
        checks.frozen(np.where(np.isfinite(tolerance_k), tolerance_k, 0)),
    )


def _with_tolerances(
    found: SmoothedCurvature,
    min_error: float,
    tolerance_mean: float | ArrayLike | None,
    tolerance_gauss: float | ArrayLike | None,
) -> tuple[Array, Array, Array, Array]:
    """Return H and K and their tolerances."""
    mean, gauss, error = (np.nan_to_num(each) for each in found)
    error = np.maximum(error, min_error / SIGNIFICANCE)
    # independent errors of k1 and k2 are larger than that of H = (k1 + k2) / 2 by sqrt(2)
    magnitude = np.sqrt(np.maximum(4 * mean**2 - 2 * gauss, 0.0))
    error_gauss = magnitude * np.sqrt(2.0) * error + 2 * error**2
    tolerance = _tolerance("tolerance_mean", tolerance_mean, SIGNIFICANCE * error, mean)
    return mean, gauss, tolerance, _tolerance("tolerance_gauss", tolerance_gauss, SIGNIFICANCE * error_gauss, mean)


def _combined(estimates: list[tuple[Array, Array, Array, Array]]) -> tuple[Array, Array, Array, Array]:
    """Return the first estimates of H and K with their tolerances; where they are zero, those that follow."""
    mean, gauss, tolerance, tolerance_k = estimates[0]
    for h, k, h_tolerance, k_tolerance in estimates[1:]:  # smoothed values near an edge contain its curvature
        replaced = (np.abs(mean) <= tolerance) & (np.abs(h) <= tolerance)
        replaced_gauss = (np.abs(gauss) <= tolerance_k) & (np.abs(k) <= tolerance_k)
        mean, tolerance = np.where(replaced, h, mean), np.where(replaced, h_tolerance, tolerance)
        gauss, tolerance_k = np.where(replaced_gauss, k, gauss), np.where(replaced_gauss, k_tolerance, tolerance_k)
    return mean, gauss, tolerance, tolerance_k


def signs(mean: Array, gauss: Array, tolerance: Array, tolerance_k: Array) -> Indices:
    """Return the class of H and K, each zero within its tolerance."""
    h = np.where(np.abs(mean) <= tolerance, 0, np.sign(mean)).astype(int)
    k = np.where(np.abs(gauss) <= tolerance_k, 0, np.sign(gauss)).astype(int)
    h = np.where((k > 0) & (h == 0), np.where(mean < 0, -1, 1), h)
    table = np.array([[SADDLE_VALLEY, VALLEY, PIT], [MINIMAL, FLAT, FLAT], [SADDLE_RIDGE, RIDGE, PEAK]])
    out: Indices = table[h + 1, k + 1]
    return out


def bent_class(mean: Array, gauss: Array, tolerance: Array) -> Indices:
    """Return flat, or the nearest of ridge, minimal and valley where k1^2 + k2^2 is significant."""
    magnitude, amplitude = (np.sqrt(np.maximum(square, 0.0)) for square in (4 * mean**2 - 2 * gauss, mean**2 - gauss))
    nearest_class = np.where(np.abs(mean) < np.tan(np.pi / 8) * amplitude, MINIMAL, np.where(mean > 0, RIDGE, VALLEY))
    out: Indices = np.where(magnitude > NOT_FLAT * tolerance, nearest_class, FLAT)
    return out


def _tolerance(name: str, given: float | ArrayLike | None, default: ArrayLike, like: Array) -> Array:
    if given is None:
        return np.broadcast_to(np.asarray(default, float), like.shape)
    if np.ndim(given) == 0:
        return np.full(like.shape, checks.number(name, given, 0.0))
    out: Array = checks.array(name, given, like.shape)
    if (out < 0).any():
        raise ValueError(f"{name} must be at least 0, not {out.min():g}")
    return out
