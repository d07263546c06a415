"""Rotation-invariant power spectrum of a signature in spherical harmonics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.recognition.partial_signatures import signature_of
from simplexmesh.recognition.sai import SAI
from simplexmesh.recognition.sphere_domain import sphere_domain

Array = NDArray[np.float64]


def power_spectrum(sai: SAI, degrees: int = 12, *, smoothing: int = 2, limit: float = 0.3) -> Array:
    """Return (degrees + 1,) square roots of a signature's power in each degree of spherical harmonics.

    By the addition theorem the power of degree l is a sum over pairs of vertices: the product of their angles times
    the Legendre polynomial P_l of the cosine between them. No harmonics are evaluated.

    Parameters
    ----------
    sai : SAI
        On a sphere, complete.
    degrees : int
    smoothing, limit
        Smoothing and clipping of the angles, as in `match`.

    Raises
    ------
    ValueError
        `sai` is not on a sphere.

    References
    ----------
    M. Kazhdan, T. Funkhouser, S. Rusinkiewicz, *Rotation invariant spherical harmonic representation of 3D shape
    descriptors*, SGP 2003.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 2, 1), 12)
    >>> one, other = (sm.sai(egg.vertices[:, axes], 5) for axes in ([0, 1, 2], [1, 2, 0]))
    >>> bool(np.allclose(power_spectrum(one), power_spectrum(other), atol=0.01))
    True
    """
    if sai.topology != "sphere":
        raise ValueError(f"sai must be a signature on a sphere, not on a {sai.topology}")
    domain = sphere_domain(sai.frequency)
    values = signature_of(sai, smoothing=smoothing, limit=limit).values * domain.cell_areas
    cosine = np.clip(domain.vertices @ domain.vertices.T, -1.0, 1.0)
    previous, legendre = np.zeros_like(cosine), np.ones_like(cosine)
    powers = []
    for degree in range(degrees + 1):
        powers.append((2 * degree + 1) / (4 * np.pi) * float(values @ legendre @ values))
        previous, legendre = legendre, ((2 * degree + 1) * cosine * legendre - degree * previous) / (degree + 1)
    return np.sqrt(np.maximum(powers, 0.0))
