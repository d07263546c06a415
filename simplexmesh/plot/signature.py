"""Plot of a spherical attribute image: each vertex of the sphere displaced radially by its simplex angle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista as pv

from simplexmesh.plot.camera import looked_at
from simplexmesh.plot.scalars import SIGNED
from simplexmesh.plot.stage import stage
from simplexmesh.plot.surface import surface
from simplexmesh.recognition.sai.attribute_image import SAI


def signature(
    sai: SAI,
    *,
    fitted: bool = False,
    view: str | Sequence[float] | None = None,
    up: str = "z",
    title: str | None = None,
    limits: tuple[float, float] | None = None,
) -> pv.Plotter:
    """Plot a signature: each vertex of the sphere at radius pi + phi, colored by phi; hidden ones gray, at radius pi.

    On a torus, a cylinder or a disc, scaled by pi, vertices are displaced by phi along the normal.

    Parameters
    ----------
    sai : SAI
        As returned by `simplexmesh.sai`.
    fitted : bool
        Also show the mesh fitted to the object, on the left, scaled to the sphere and in the same colors.
    view, up, title, limits
        As for `surface`; limits in radians.

    References
    ----------
    H. Delingette, thesis, 1994, section 6.2.2.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> plotter = signature(sm.sai(sm.ellipsoid((3, 2, 1), 12), frequency=5))
    >>> plotter.close()
    """
    if not isinstance(sai, SAI):
        raise TypeError(f"sai must be an SAI, as returned by simplexmesh.sai, not {type(sai).__name__}")
    values = np.where(sai.hidden, np.nan, sai.angles)
    if limits is None:
        most = float(np.nanpercentile(np.abs(values), 98))
        limits = (-most, most)
    plotter = stage(columns=2 if fitted else 1)
    model = sai.domain.mesh
    outward = model.vertices if sai.topology == "sphere" else model.normals
    images = [model.moved(np.pi * model.vertices + np.where(sai.hidden, 0.0, sai.angles)[:, None] * outward)]
    if fitted:
        at = sai.mesh.vertices - 0.5 * (sai.mesh.vertices.min(axis=0) + sai.mesh.vertices.max(axis=0))
        size = 1.1 * np.pi * np.linalg.norm(model.vertices, axis=1).max()
        images.insert(0, sai.mesh.moved(at * (size / np.linalg.norm(at, axis=1).max())))
    for column, mesh in enumerate(images):
        plotter.subplot(0, column)
        headed = title if column == 0 else None
        surface(mesh.with_data(**{SIGNED: values}), scalars=SIGNED, limits=limits, plotter=plotter, title=headed)
    return looked_at(plotter, view, up=up)
