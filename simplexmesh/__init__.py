"""simplexmesh: compact, well-formed surface models from scans and volumes.

The public names, chapter by chapter. Each is loaded when first used, so importing the package costs almost nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "errors": ["TopologyError", "DivergedError"],
    # I    the mesh
    "mesh.connectivity": ["Connectivity"],
    "mesh.simplex_mesh": ["SimplexMesh"],
    "mesh.duality": ["dual"],
    "mesh.shapes": ["sphere", "ellipsoid", "cylinder", "plane", "torus"],
    # II   the data
    "data.volume": ["Volume"],
    "data.points": ["PointCloud"],
    "data.triangles": ["TriangleMesh"],
    "data.reading": ["read", "read_volume", "read_points", "read_triangles", "read_mesh", "read_poses"],
    # III  the motion
    "motion.deform": ["DeformableModel"],
    "motion.reconstruct": ["reconstruct", "Reconstruction"],
}
_MODULE = {name: f"simplexmesh.{module}" for module, names in _HOME.items() for name in names}
_MODULE["targets"] = "simplexmesh.motion.targets"

__all__ = sorted([*_MODULE, "__version__"])

if TYPE_CHECKING:
    pass


def __getattr__(name: str) -> Any:
    if name not in _MODULE:
        raise AttributeError(f"module 'simplexmesh' has no attribute {name!r}")
    module = importlib.import_module(_MODULE[name])
    value = module if name == "targets" else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
