"""Planes, spheres, cylinders, cones, tori, lines, circles, beams and flanges: distances, samples, meshes."""

from simplexmesh.data.primitives.base import Primitive as Primitive
from simplexmesh.data.primitives.circle import Circle as Circle
from simplexmesh.data.primitives.composed.beam import Beam as Beam
from simplexmesh.data.primitives.composed.flange import Flange as Flange
from simplexmesh.data.primitives.composed.flange import FlangePair as FlangePair
from simplexmesh.data.primitives.cone import Cone as Cone
from simplexmesh.data.primitives.cylinder import Cylinder as Cylinder
from simplexmesh.data.primitives.fits import Fit as Fit
from simplexmesh.data.primitives.fits import fit_of as fit_of
from simplexmesh.data.primitives.line import Line as Line
from simplexmesh.data.primitives.plane import Plane as Plane
from simplexmesh.data.primitives.sphere import Sphere as Sphere
from simplexmesh.data.primitives.torus import Torus as Torus

__all__ = [
    *(
        "Beam",
        "Circle",
        "Cone",
        "Cylinder",
        "Fit",
        "Flange",
        "FlangePair",
        "Line",
        "Plane",
        "Primitive",
        "Sphere",
        "Torus",
    ),
]
