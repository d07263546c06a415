"""Pictures: a surface with its polygons, colored by curvature or by distance to data, or data beside its model.

Every function returns a `pyvista.Plotter`: `.show()` opens it in a window or a notebook, `picture` writes it to a file.

Examples
--------
>>> import simplexmesh as sm
>>> plotter = sm.plot.surface(sm.torus(), scalars="mean_curvature")
>>> plotter.close()
"""

from simplexmesh.plot.attribute_image import signature
from simplexmesh.plot.bent import curvature
from simplexmesh.plot.camera import looked_at
from simplexmesh.plot.landscape import landscape
from simplexmesh.plot.overlay import overlay
from simplexmesh.plot.paint import classes, heat
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
