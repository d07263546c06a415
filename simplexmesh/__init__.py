"""simplexmesh: compact, well-formed surface models from scans and volumes.

The public names, chapter by chapter. Each is loaded when first used, so importing the package costs almost nothing.

Examples
--------
>>> import simplexmesh as sm
>>> ball = sm.sphere(4, radius=2.0)
>>> ball.genus
0
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "errors": ["TopologyError", "DivergedError", "SimplexMeshWarning"],
    # I    the mesh
    "mesh.connectivity": ["Connectivity"],
    "mesh.simplex_mesh": ["SimplexMesh"],
    "mesh.duality": ["dual"],
    "mesh.shapes": ["sphere", "ellipsoid", "cylinder", "plane", "torus"],
    "mesh.operators": ["remove_edge", "insert_edge", "swap_edge", "remove_face", "refine_face"],
    "mesh.joining": ["cut", "join", "parts"],
    "mesh.contours": ["Contour"],
    "mesh.editing": ["EditableMesh"],
    "mesh.regularize": ["regularize"],
    "mesh.decimate": ["decimate", "Decimated"],
    # II   the data
    "data.volume": ["Volume"],
    "data.points": ["PointCloud"],
    "data.triangles": ["TriangleMesh"],
    "data.reading": ["read", "read_volume", "read_points", "read_triangles", "read_mesh"],
    "data.poses": ["read_poses"],
    "data.clipping": ["clipped"],
    "data.dividing": ["divided"],
    "data.boolean": ["boolean"],
    # III  the motion
    "motion.deform": ["DeformableModel"],
    "motion.reconstruct": ["reconstruct", "Reconstruction"],
    "motion.refine": ["refine"],
    "motion.redistribute": ["redistribute"],
    "motion.holes": ["open_holes"],
    "motion.handles": ["add_handles"],
    "motion.deviation": ["Deviation", "deviation"],
    # IV   the recognition
    "recognition.sai": ["SAI", "sai"],
    "recognition.matches": ["Match"],
    "recognition.match": ["match"],
    "recognition.register": ["Pose", "Registration", "register"],
    "recognition.library": ["ModelLibrary", "Recognition"],
    "recognition.align": ["align", "Alignment"],
    "recognition.occlude": ["occlude", "Occlusion"],
    # V    the surface
    "surface.neighborhoods": ["Neighborhoods", "ball", "nearest", "rings"],
    "surface.normals.estimate": ["vertex_normals"],
    "surface.spread": ["Spread", "spread"],
    "surface.quality": ["aspect_ratios"],
    "surface.curvature.estimate": ["curvature"],
    "surface.curvature.result": ["Curvature"],
    "surface.saliency": ["saliency"],
    "surface.salient": ["salient_points", "SalientPoints"],
    "surface.classes": ["hk_classes", "HKClasses"],
    "surface.regions": ["Regions", "regions"],
    "surface.inversion": ["inversion_lines", "level_lines", "Polyline"],
    "surface.landmarks": ["Landmark", "snap_landmark"],
    "surface.circle": ["Circle", "fit_circle", "rim_circle"],
    "surface.morph": ["morphed"],
}
_MODULE = {name: f"simplexmesh.{module}" for module, names in _HOME.items() for name in names}
_SUBMODULES = {"targets": "simplexmesh.motion.targets", "plot": "simplexmesh.plot"}

__all__ = sorted([*_MODULE, *_SUBMODULES, "__version__"])

if TYPE_CHECKING:  # the same list once more, for type checkers and editors; a test compares the two
    from simplexmesh import plot as plot
    from simplexmesh.data.boolean import boolean as boolean
    from simplexmesh.data.clipping import clipped as clipped
    from simplexmesh.data.dividing import divided as divided
    from simplexmesh.data.points import PointCloud as PointCloud
    from simplexmesh.data.poses import read_poses as read_poses
    from simplexmesh.data.reading import read as read
    from simplexmesh.data.reading import read_mesh as read_mesh
    from simplexmesh.data.reading import read_points as read_points
    from simplexmesh.data.reading import read_triangles as read_triangles
    from simplexmesh.data.reading import read_volume as read_volume
    from simplexmesh.data.triangles import TriangleMesh as TriangleMesh
    from simplexmesh.data.volume import Volume as Volume
    from simplexmesh.errors import DivergedError as DivergedError
    from simplexmesh.errors import SimplexMeshWarning as SimplexMeshWarning
    from simplexmesh.errors import TopologyError as TopologyError
    from simplexmesh.mesh.connectivity import Connectivity as Connectivity
    from simplexmesh.mesh.contours import Contour as Contour
    from simplexmesh.mesh.decimate import Decimated as Decimated
    from simplexmesh.mesh.decimate import decimate as decimate
    from simplexmesh.mesh.duality import dual as dual
    from simplexmesh.mesh.editing import EditableMesh as EditableMesh
    from simplexmesh.mesh.joining import cut as cut
    from simplexmesh.mesh.joining import join as join
    from simplexmesh.mesh.joining import parts as parts
    from simplexmesh.mesh.operators import insert_edge as insert_edge
    from simplexmesh.mesh.operators import refine_face as refine_face
    from simplexmesh.mesh.operators import remove_edge as remove_edge
    from simplexmesh.mesh.operators import remove_face as remove_face
    from simplexmesh.mesh.operators import swap_edge as swap_edge
    from simplexmesh.mesh.regularize import regularize as regularize
    from simplexmesh.mesh.shapes import cylinder as cylinder
    from simplexmesh.mesh.shapes import ellipsoid as ellipsoid
    from simplexmesh.mesh.shapes import plane as plane
    from simplexmesh.mesh.shapes import sphere as sphere
    from simplexmesh.mesh.shapes import torus as torus
    from simplexmesh.mesh.simplex_mesh import SimplexMesh as SimplexMesh
    from simplexmesh.motion import targets as targets
    from simplexmesh.motion.deform import DeformableModel as DeformableModel
    from simplexmesh.motion.deviation import Deviation as Deviation
    from simplexmesh.motion.deviation import deviation as deviation
    from simplexmesh.motion.handles import add_handles as add_handles
    from simplexmesh.motion.holes import open_holes as open_holes
    from simplexmesh.motion.reconstruct import Reconstruction as Reconstruction
    from simplexmesh.motion.reconstruct import reconstruct as reconstruct
    from simplexmesh.motion.redistribute import redistribute as redistribute
    from simplexmesh.motion.refine import refine as refine
    from simplexmesh.recognition.align import Alignment as Alignment
    from simplexmesh.recognition.align import align as align
    from simplexmesh.recognition.library import ModelLibrary as ModelLibrary
    from simplexmesh.recognition.library import Recognition as Recognition
    from simplexmesh.recognition.match import match as match
    from simplexmesh.recognition.matches import Match as Match
    from simplexmesh.recognition.occlude import Occlusion as Occlusion
    from simplexmesh.recognition.occlude import occlude as occlude
    from simplexmesh.recognition.register import Pose as Pose
    from simplexmesh.recognition.register import Registration as Registration
    from simplexmesh.recognition.register import register as register
    from simplexmesh.recognition.sai import SAI as SAI
    from simplexmesh.recognition.sai import sai as sai
    from simplexmesh.surface.circle import Circle as Circle
    from simplexmesh.surface.circle import fit_circle as fit_circle
    from simplexmesh.surface.circle import rim_circle as rim_circle
    from simplexmesh.surface.classes import HKClasses as HKClasses
    from simplexmesh.surface.classes import hk_classes as hk_classes
    from simplexmesh.surface.curvature.estimate import curvature as curvature
    from simplexmesh.surface.curvature.result import Curvature as Curvature
    from simplexmesh.surface.inversion import Polyline as Polyline
    from simplexmesh.surface.inversion import inversion_lines as inversion_lines
    from simplexmesh.surface.inversion import level_lines as level_lines
    from simplexmesh.surface.landmarks import Landmark as Landmark
    from simplexmesh.surface.landmarks import snap_landmark as snap_landmark
    from simplexmesh.surface.morph import morphed as morphed
    from simplexmesh.surface.neighborhoods import Neighborhoods as Neighborhoods
    from simplexmesh.surface.neighborhoods import ball as ball
    from simplexmesh.surface.neighborhoods import nearest as nearest
    from simplexmesh.surface.neighborhoods import rings as rings
    from simplexmesh.surface.normals.estimate import vertex_normals as vertex_normals
    from simplexmesh.surface.quality import aspect_ratios as aspect_ratios
    from simplexmesh.surface.regions import Regions as Regions
    from simplexmesh.surface.regions import regions as regions
    from simplexmesh.surface.saliency import saliency as saliency
    from simplexmesh.surface.salient import SalientPoints as SalientPoints
    from simplexmesh.surface.salient import salient_points as salient_points
    from simplexmesh.surface.spread import Spread as Spread
    from simplexmesh.surface.spread import spread as spread


def __getattr__(name: str) -> Any:
    if name in _SUBMODULES:
        value: Any = importlib.import_module(_SUBMODULES[name])
    elif name in _MODULE:
        value = getattr(importlib.import_module(_MODULE[name]), name)
    else:
        raise AttributeError(f"module 'simplexmesh' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
