"""Plots of meshes, point clouds and volumes, of scalars and classes on them, and of shape signatures.

Every function returns a `pyvista.Plotter`: `.show()` opens a window or draws in a notebook, `picture` writes a file.

Examples
--------
>>> import simplexmesh as sm
>>> plotter = sm.plot.surface(sm.torus(), scalars="mean_curvature")
>>> plotter.close()
"""

from simplexmesh.plot.camera import looked_at
from simplexmesh.plot.classes import classes
from simplexmesh.plot.curvature import curvature
from simplexmesh.plot.features import features
from simplexmesh.plot.heat import heat
from simplexmesh.plot.overlay import overlay
from simplexmesh.plot.panels import beside, panels, together
from simplexmesh.plot.primitives import primitives
from simplexmesh.plot.signature import landscape, signature
from simplexmesh.plot.stage import has_display, picture, stage
from simplexmesh.plot.surface import surface

__all__ = [
    "beside",
    "classes",
    "curvature",
    "features",
    "has_display",
    "heat",
    "landscape",
    "looked_at",
    "overlay",
    "panels",
    "picture",
    "primitives",
    "signature",
    "stage",
    "surface",
    "together",
]


def __dir__() -> list[str]:
    return __all__
