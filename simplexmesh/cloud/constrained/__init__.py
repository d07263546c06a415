"""Primitives bound to a neighbor in a pipe line: fewer parameters instead of multipliers (Chaperon 2002, 4.3.1).

Each is `fitted` to points by its own few parameters, and gives the free primitive that it is.
"""

from simplexmesh.cloud.constrained.base import Constrained as Constrained
from simplexmesh.cloud.constrained.base import fitted as fitted
from simplexmesh.cloud.constrained.cones import CoaxialCone as CoaxialCone
from simplexmesh.cloud.constrained.cones import SecantCone as SecantCone
from simplexmesh.cloud.constrained.cylinders import BallJointCylinder as BallJointCylinder
from simplexmesh.cloud.constrained.cylinders import CylinderAfterTorus as CylinderAfterTorus
from simplexmesh.cloud.constrained.cylinders import SecantCylinder as SecantCylinder
from simplexmesh.cloud.constrained.tori import TorusAfterCylinder as TorusAfterCylinder
from simplexmesh.cloud.constrained.tori import TorusBetweenCylinders as TorusBetweenCylinders
