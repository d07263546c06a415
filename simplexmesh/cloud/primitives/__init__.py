"""Planes, spheres, cylinders, cones, tori, lines and circles: exact distances, coordinates, samples, meshes."""

from simplexmesh.cloud.primitives.base import Fit as Fit
from simplexmesh.cloud.primitives.base import Primitive as Primitive
from simplexmesh.cloud.primitives.circle import Circle as Circle
from simplexmesh.cloud.primitives.cone import Cone as Cone
from simplexmesh.cloud.primitives.cylinder import Cylinder as Cylinder
from simplexmesh.cloud.primitives.line import Line as Line
from simplexmesh.cloud.primitives.plane import Plane as Plane
from simplexmesh.cloud.primitives.sphere import Sphere as Sphere
from simplexmesh.cloud.primitives.torus import Torus as Torus

__all__ = ["Circle", "Cone", "Cylinder", "Fit", "Line", "Plane", "Primitive", "Sphere", "Torus"]
