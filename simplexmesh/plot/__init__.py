"""Plots of meshes, point clouds and volumes, of scalars and classes on them, and of shape signatures.

Every function returns a `pyvista.Plotter`: `.show()` opens a window or draws in a notebook, `picture` writes a file.

Examples
--------
>>> import simplexmesh as sm
>>> plotter = sm.plot.surface(sm.torus(), scalars="mean_curvature")
>>> plotter.close()
"""

from simplexmesh.plot.attribute_image import signature
from simplexmesh.plot.camera import looked_at
from simplexmesh.plot.coloring import classes, heat
from simplexmesh.plot.curvature_panels import curvature
from simplexmesh.plot.landscape import landscape
from simplexmesh.plot.overlay import overlay
from simplexmesh.plot.scenes import beside, panels, surface, together
from simplexmesh.plot.stage import has_display, picture, stage

__all__ = [
    "beside",
    "classes",
    "curvature",
    "has_display",
    "heat",
    "landscape",
    "looked_at",
    "overlay",
    "panels",
    "picture",
    "signature",
    "stage",
    "surface",
    "together",
]


def __dir__() -> list[str]:
    return __all__
