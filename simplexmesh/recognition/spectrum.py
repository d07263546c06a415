"""The part of a signature that no rotation changes: how much of it there is in spherical harmonics of each degree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.recognition.occlusion import signature_of
from simplexmesh.recognition.sai import SAI
from simplexmesh.recognition.spheres import ball

Array = NDArray[np.float64]


def power_spectrum(sai: SAI, degrees: int = 12, *, smoothing: int = 2, limit: float = 0.3) -> Array:
    """Return (degrees + 1,) the root of the power of a signature in each degree of its spherical harmonics.

    By the addition theorem the sum over all orders of a degree l is a sum over pairs of vertices of the product of
    their angles with Legendre's polynomial of the cosine between them; no harmonic itself is needed.

    Parameters
    ----------
    sai : SAI
        On a sphere, complete.
    degrees : int
    smoothing, limit
        How angles are smoothed and cut off, as in `match`.

    Raises
    ------
    ValueError
        A signature on something else.

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
    here = ball(sai.frequency)
    values = signature_of(sai, smoothing=smoothing, limit=limit).values * here.cell_areas
    cosine = np.clip(here.vertices @ here.vertices.T, -1.0, 1.0)
    before, legendre = np.zeros_like(cosine), np.ones_like(cosine)
    powers = []
    for degree in range(degrees + 1):
        powers.append((2 * degree + 1) / (4 * np.pi) * float(values @ legendre @ values))
        before, legendre = legendre, ((2 * degree + 1) * cosine * legendre - degree * before) / (degree + 1)
    return np.sqrt(np.maximum(powers, 0.0))
