"""The eight kinds of surface by the signs of mean and Gaussian curvature (Besl and Jain 1986)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.diffusion import Diffusion
from simplexmesh.surface.fields import known_curvature
from simplexmesh.surface.samples import as_samples
from simplexmesh.surface.smoothed_curvature import SmoothedCurvature, shrunk, smoothed_curvature

Array = NDArray[np.float64]

UNKNOWN, PEAK, RIDGE, SADDLE_RIDGE, FLAT, MINIMAL, SADDLE_VALLEY, VALLEY, PIT = range(9)

NAMES = ("unknown", "peak", "ridge", "saddle ridge", "flat", "minimal", "saddle valley", "valley", "pit")
"""By class number; outward bends come first, then flat, then inward bends."""

COLORS = (
    "#8c8c8c", "#c8322b", "#ee8a4a", "#f3cf7a", "#cfcfc6", "#9ccf8d", "#8fd0dd", "#4a8fd0", "#3a3f9e",
)  # fmt: skip
"""One for each class: red outward, blue inward."""

CERTAIN = 1.5
"""A curvature is taken for zero within so many of its standard deviations."""

BENT = 2.3
"""Where the root of k1^2 + k2^2 is above so many tolerances of H the surface is not flat."""

STRAIGHT = 0.3
"""Nor does one count that is less than this over the diagonal: what bends with a radius of three diagonals is flat."""


@dataclass(frozen=True, eq=False, repr=False)
class HKClasses:
    """Which of eight kinds the surface is at each vertex.

    ===================  =====  ======  =============
    .                    K > 0  K = 0   K < 0
    ===================  =====  ======  =============
    H > 0, bends out     peak   ridge   saddle ridge
    H = 0                .      flat    minimal
    H < 0, bends in      pit    valley  saddle valley
    ===================  =====  ======  =============

    Attributes
    ----------
    labels : (n,) array of int
        Place in `names`; 0 where curvature is not known.
    tolerance_mean, tolerance_gauss : (n,) array of float
        Within which H, in 1 / length, and K, in 1 / length squared, were taken for zero.
    names, colors : tuple of str
        Of the classes.

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
        """How many vertices are of each class there is."""
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
    """Return which of eight kinds a surface is at each vertex, by the signs of H and K.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        What is looked at.
    curvature : Curvature, optional
        Of the surface, when already known; otherwise it is measured.
    scale : float, optional
        Width of the window over which H and K are averaged first, in the surface's unit of length; 0 for none. By
        default each vertex is averaged over the smallest window of `saliency`'s, 0.6 % of the diagonal or 1.5 edges,
        as far as the error that the method tells asks for: not at all on clean meshes, wholly on noisy ones. What is
        zero then is looked at again in the whole window.
    tolerance_mean, tolerance_gauss : float or (n,) array of float, optional
        Within which H, in 1 / length, and K, in 1 / length squared, count as zero. By default one and a half standard
        deviations: the error of H that the method gives, as far as it shows between neighbors, or the field_noise of H
        from vertex to vertex, less what averaging takes away, and at least 0.3 over the diagonal; that of K follows,
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

    K is at most H squared: where K says that the surface bends one way all around while H is within its tolerance,
    the sign of H decides, peak or pit.

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
    samples = as_samples(surface)
    diffusion = Diffusion(samples)
    known = known_curvature(samples, curvature)
    opinions: tuple[SmoothedCurvature, ...]
    if scale is None:
        opinions = shrunk(diffusion, known)
    else:
        opinions = (smoothed_curvature(diffusion, known, _check.number("scale", scale, 0.0)),)
    least = STRAIGHT / diffusion.diagonal if diffusion.diagonal > 0 else 0.0
    mean, gauss, near, near_gauss = _combined(
        [_judged(each, least, tolerance_mean, tolerance_gauss) for each in opinions]
    )
    labels = signs(mean, gauss, near, near_gauss)
    if tolerance_mean is None and tolerance_gauss is None:
        labels = np.where(labels == FLAT, bent_class(mean, gauss, near), labels)
    labels = np.where(known.failed, UNKNOWN, labels)
    return HKClasses(
        _check.frozen(labels, np.int8),
        _check.frozen(near),
        _check.frozen(np.where(np.isfinite(near_gauss), near_gauss, 0)),
    )


def _judged(
    found: SmoothedCurvature,
    least: float,
    tolerance_mean: float | ArrayLike | None,
    tolerance_gauss: float | ArrayLike | None,
) -> tuple[Array, Array, Array, Array]:
    """Return H and K, and within which they count as zero."""
    mean, gauss, error = (np.nan_to_num(each) for each in found)
    error = np.maximum(error, least / CERTAIN)
    # dk is larger than dH = (dk1 + dk2) / 2 by the root of 2
    bent = np.sqrt(np.maximum(4 * mean**2 - 2 * gauss, 0.0))
    error_gauss = bent * np.sqrt(2.0) * error + 2 * error**2
    near = _tolerance("tolerance_mean", tolerance_mean, CERTAIN * error, mean)
    return mean, gauss, near, _tolerance("tolerance_gauss", tolerance_gauss, CERTAIN * error_gauss, mean)


def _combined(opinions: list[tuple[Array, Array, Array, Array]]) -> tuple[Array, Array, Array, Array]:
    """Return of H, and of K, what the first says; where that is zero, what a later one says, if the first allows it.

    A window near the edge of a face has some of the edge's bend: beyond the first's tolerance it is not believed.
    """
    mean, gauss, near, near_gauss = opinions[0]
    for h, k, within, within_gauss in opinions[1:]:
        asked = (np.abs(mean) <= near) & (np.abs(h) <= near)
        asked_gauss = (np.abs(gauss) <= near_gauss) & (np.abs(k) <= near_gauss)
        mean, near = np.where(asked, h, mean), np.where(asked, within, near)
        gauss, near_gauss = np.where(asked_gauss, k, gauss), np.where(asked_gauss, within_gauss, near_gauss)
    return mean, gauss, near, near_gauss


def signs(mean: Array, gauss: Array, near: Array, near_gauss: Array) -> NDArray[np.int64]:
    """Return the class of H and K, each zero within its tolerance."""
    h = np.where(np.abs(mean) <= near, 0, np.sign(mean)).astype(int)
    k = np.where(np.abs(gauss) <= near_gauss, 0, np.sign(gauss)).astype(int)
    h = np.where((k > 0) & (h == 0), np.where(mean < 0, -1, 1), h)
    table = np.array([[SADDLE_VALLEY, VALLEY, PIT], [MINIMAL, FLAT, FLAT], [SADDLE_RIDGE, RIDGE, PEAK]])
    out: NDArray[np.int64] = table[h + 1, k + 1]
    return out


def bent_class(mean: Array, gauss: Array, near: Array) -> NDArray[np.int64]:
    """Return flat, or the nearest of ridge, minimal and valley where it bends though neither H nor K shows it.

    Near a saddle with large errors H is small and K uncertain, and yet k1 and k2 are known not to be zero.
    """
    bent, swing = (np.sqrt(np.maximum(square, 0.0)) for square in (4 * mean**2 - 2 * gauss, mean**2 - gauss))
    named = np.where(np.abs(mean) < np.tan(np.pi / 8) * swing, MINIMAL, np.where(mean > 0, RIDGE, VALLEY))
    out: NDArray[np.int64] = np.where(bent > BENT * near, named, FLAT)
    return out


def _tolerance(name: str, given: float | ArrayLike | None, default: ArrayLike, like: Array) -> Array:
    if given is None:
        return np.broadcast_to(np.asarray(default, float), like.shape)
    if np.ndim(given) == 0:
        return np.full(like.shape, _check.number(name, given, 0.0))
    out: Array = _check.array(name, given, like.shape)
    if (out < 0).any():
        raise ValueError(f"{name} must be at least 0, not {out.min():g}")
    return out
