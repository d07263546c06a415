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

from simplexmesh._base.progress import announce_compiling

__version__ = "0.1.0"

_HOME = {
    "_base.errors": ["TopologyError", "DivergedError", "SimplexMeshWarning"],
    # I    the mesh
    "mesh.connectivity": ["Connectivity"],
    "mesh.simplex_mesh": ["SimplexMesh"],
    "mesh.duality": ["dual"],
    "mesh.shapes": ["sphere", "ellipsoid", "cylinder", "plane", "torus"],
    "mesh.operators.single_edits": ["remove_edge", "insert_edge", "swap_edge", "remove_face", "refine_face"],
    "mesh.operators.cut_join": ["cut", "join", "parts", "Cut", "Joined"],
    "mesh.contours": ["Contour"],
    "mesh.operators.editable_mesh": ["EditableMesh"],
    "mesh.operators.regularize": ["regularize", "Regularized"],
    "data.decimate": ["decimate"],
    "mesh.decimation.decimated": ["Decimated"],
    "mesh.operators.results": ["Edited", "Batch"],
    "mesh.operators.seams": ["Seam"],
    "mesh.check": ["Report"],
    "mesh.triangles.topology": ["Topology"],
    # II   the data
    "data.volume": ["Volume"],
    "data.points": ["PointCloud"],
    "data.triangles": ["TriangleMesh"],
    "data.io.reading": ["read", "read_volume", "read_points", "read_triangles", "read_mesh"],
    "data.saving": ["save"],
    "data.poses": ["read_poses"],
    "data.cutting.clipping": ["clipped"],
    "data.cutting.dividing": ["divided"],
    "data.cutting.separating": ["separated"],
    "data.cutting.boolean": ["boolean"],
    # III  the motion
    "motion.model.deform": ["DeformableModel"],
    "motion.model.conditions": ["Condition", "pinned", "crease", "smooth"],
    "recognition.scans.reconstruct": ["reconstruct"],  # `motion.reconstruct.pipeline`, with the poses of scans
    "motion.reconstruct.result": ["Reconstruction", "Distance", "Summary", "TopologyRecord"],
    "motion.start.report": ["StartReport"],
    "motion.density.refine": ["refine"],
    "motion.density.redistribute": ["redistribute"],
    "motion.topology.holes": ["open_holes", "Opened", "HoleProposal"],
    "motion.topology.handles": ["add_handles", "Handled", "HandleProposal"],
    "motion.reconstruct.deviation": ["Deviation", "deviation"],
    "motion.model.state": ["State"],
    "motion.density.refinement": ["Refined", "Round"],
    # IV   the recognition
    "recognition.sai.attribute_image": ["SAI"],
    "recognition.sai.sai": ["sai"],
    "recognition.sai.match_result": ["Match"],
    "recognition.sai.match": ["match"],
    "recognition.register.register": ["Pose", "Registration", "register"],
    "recognition.library.library": ["ModelLibrary", "Recognition"],
    "recognition.register.align": ["align", "Alignment"],
    "recognition.scans.register_all": ["register_all", "Registered", "ScanPair"],
    "recognition.contact.occlude": ["occlude", "Occlusion"],
    # V    the surface
    "surface.neighborhoods": ["Neighborhoods", "ball", "nearest", "rings", "Rings", "Ball", "Nearest"],
    "surface.normals.estimate": ["vertex_normals"],
    "surface.spread": ["Spread", "spread"],
    "surface.quality": ["aspect_ratios"],
    "surface.curvature.estimate": ["curvature"],
    "surface.curvature.result": ["Curvature"],
    "surface.features.aligned": ["aligned"],
    "surface.features.feature_lines": ["feature_lines"],
    "surface.features.lines.network": ["FeatureLine", "FeatureNetwork"],
    "surface.features.simplify": ["simplify"],
    "surface.features.zones": ["zones"],
    "surface.features.zoning.result": ["Zones"],
    "surface.saliency.saliency": ["saliency"],
    "surface.saliency.salient_points": ["salient_points", "SalientPoints"],
    "surface.saliency.hk_classes": ["hk_classes", "HKClasses"],
    "surface.saliency.regions": ["Regions", "regions"],
    "surface.saliency.level_lines": ["inversion_lines", "level_lines"],
    "surface.polyline": ["Polyline"],
    "surface.landmarks.snap_landmark": ["Landmark", "snap_landmark"],
    "surface.landmarks.circle": ["fit_circle", "rim_circle"],
    "surface.landmarks.morphed": ["morphed"],
    # VI   the cloud
    "cloud.extraction.extract": ["extract_primitives"],
    "cloud.extraction.result": ["Extraction"],
    "cloud.fitting.fit": ["fit_primitive"],
    "cloud.pipes.follow": ["follow_pipe"],
    "cloud.validation.validation": ["Validation"],
    "cloud.validation.outcome": ["Outcome"],
    "cloud.pipes.line": ["Deviations", "PipeElement", "PipeLine"],
    "cloud.pipes.chain": ["Chain", "Feet"],
    "cloud.pipes.plant": ["Plant", "extract_pipes"],
}
_MODULE = {name: f"simplexmesh.{module}" for module, names in _HOME.items() for name in names}
_SUBMODULES = {
    "targets": "simplexmesh.motion.targets",
    "primitives": "simplexmesh.data.primitives",
    "plot": "simplexmesh.plot",
}

__all__ = sorted([*_MODULE, *_SUBMODULES, "__version__"])

if TYPE_CHECKING:  # the same list once more, for type checkers and editors; a test compares the two
    from simplexmesh import plot as plot
    from simplexmesh._base.errors import DivergedError as DivergedError
    from simplexmesh._base.errors import SimplexMeshWarning as SimplexMeshWarning
    from simplexmesh._base.errors import TopologyError as TopologyError
    from simplexmesh.cloud.extraction.extract import extract_primitives as extract_primitives
    from simplexmesh.cloud.extraction.result import Extraction as Extraction
    from simplexmesh.cloud.fitting.fit import fit_primitive as fit_primitive
    from simplexmesh.cloud.pipes.chain import Chain as Chain
    from simplexmesh.cloud.pipes.chain import Feet as Feet
    from simplexmesh.cloud.pipes.follow import follow_pipe as follow_pipe
    from simplexmesh.cloud.pipes.line import Deviations as Deviations
    from simplexmesh.cloud.pipes.line import PipeElement as PipeElement
    from simplexmesh.cloud.pipes.line import PipeLine as PipeLine
    from simplexmesh.cloud.pipes.plant import Plant as Plant
    from simplexmesh.cloud.pipes.plant import extract_pipes as extract_pipes
    from simplexmesh.cloud.validation.outcome import Outcome as Outcome
    from simplexmesh.cloud.validation.validation import Validation as Validation
    from simplexmesh.data import primitives as primitives
    from simplexmesh.data.cutting.boolean import boolean as boolean
    from simplexmesh.data.cutting.clipping import clipped as clipped
    from simplexmesh.data.cutting.dividing import divided as divided
    from simplexmesh.data.cutting.separating import separated as separated
    from simplexmesh.data.decimate import decimate as decimate
    from simplexmesh.data.io.reading import read as read
    from simplexmesh.data.io.reading import read_mesh as read_mesh
    from simplexmesh.data.io.reading import read_points as read_points
    from simplexmesh.data.io.reading import read_triangles as read_triangles
    from simplexmesh.data.io.reading import read_volume as read_volume
    from simplexmesh.data.points import PointCloud as PointCloud
    from simplexmesh.data.poses import read_poses as read_poses
    from simplexmesh.data.saving import save as save
    from simplexmesh.data.triangles import TriangleMesh as TriangleMesh
    from simplexmesh.data.volume import Volume as Volume
    from simplexmesh.mesh.check import Report as Report
    from simplexmesh.mesh.connectivity import Connectivity as Connectivity
    from simplexmesh.mesh.contours import Contour as Contour
    from simplexmesh.mesh.decimation.decimated import Decimated as Decimated
    from simplexmesh.mesh.duality import dual as dual
    from simplexmesh.mesh.operators.cut_join import Cut as Cut
    from simplexmesh.mesh.operators.cut_join import Joined as Joined
    from simplexmesh.mesh.operators.cut_join import cut as cut
    from simplexmesh.mesh.operators.cut_join import join as join
    from simplexmesh.mesh.operators.cut_join import parts as parts
    from simplexmesh.mesh.operators.editable_mesh import EditableMesh as EditableMesh
    from simplexmesh.mesh.operators.regularize import Regularized as Regularized
    from simplexmesh.mesh.operators.regularize import regularize as regularize
    from simplexmesh.mesh.operators.results import Batch as Batch
    from simplexmesh.mesh.operators.results import Edited as Edited
    from simplexmesh.mesh.operators.seams import Seam as Seam
    from simplexmesh.mesh.operators.single_edits import insert_edge as insert_edge
    from simplexmesh.mesh.operators.single_edits import refine_face as refine_face
    from simplexmesh.mesh.operators.single_edits import remove_edge as remove_edge
    from simplexmesh.mesh.operators.single_edits import remove_face as remove_face
    from simplexmesh.mesh.operators.single_edits import swap_edge as swap_edge
    from simplexmesh.mesh.shapes import cylinder as cylinder
    from simplexmesh.mesh.shapes import ellipsoid as ellipsoid
    from simplexmesh.mesh.shapes import plane as plane
    from simplexmesh.mesh.shapes import sphere as sphere
    from simplexmesh.mesh.shapes import torus as torus
    from simplexmesh.mesh.simplex_mesh import SimplexMesh as SimplexMesh
    from simplexmesh.mesh.triangles.topology import Topology as Topology
    from simplexmesh.motion import targets as targets
    from simplexmesh.motion.density.redistribute import redistribute as redistribute
    from simplexmesh.motion.density.refine import refine as refine
    from simplexmesh.motion.density.refinement import Refined as Refined
    from simplexmesh.motion.density.refinement import Round as Round
    from simplexmesh.motion.model.conditions import Condition as Condition
    from simplexmesh.motion.model.conditions import crease as crease
    from simplexmesh.motion.model.conditions import pinned as pinned
    from simplexmesh.motion.model.conditions import smooth as smooth
    from simplexmesh.motion.model.deform import DeformableModel as DeformableModel
    from simplexmesh.motion.model.state import State as State
    from simplexmesh.motion.reconstruct.deviation import Deviation as Deviation
    from simplexmesh.motion.reconstruct.deviation import deviation as deviation
    from simplexmesh.motion.reconstruct.result import Distance as Distance
    from simplexmesh.motion.reconstruct.result import Reconstruction as Reconstruction
    from simplexmesh.motion.reconstruct.result import Summary as Summary
    from simplexmesh.motion.reconstruct.result import TopologyRecord as TopologyRecord
    from simplexmesh.motion.start.report import StartReport as StartReport
    from simplexmesh.motion.topology.handles import Handled as Handled
    from simplexmesh.motion.topology.handles import HandleProposal as HandleProposal
    from simplexmesh.motion.topology.handles import add_handles as add_handles
    from simplexmesh.motion.topology.holes import HoleProposal as HoleProposal
    from simplexmesh.motion.topology.holes import Opened as Opened
    from simplexmesh.motion.topology.holes import open_holes as open_holes
    from simplexmesh.recognition.contact.occlude import Occlusion as Occlusion
    from simplexmesh.recognition.contact.occlude import occlude as occlude
    from simplexmesh.recognition.library.library import ModelLibrary as ModelLibrary
    from simplexmesh.recognition.library.library import Recognition as Recognition
    from simplexmesh.recognition.register.align import Alignment as Alignment
    from simplexmesh.recognition.register.align import align as align
    from simplexmesh.recognition.register.register import Pose as Pose
    from simplexmesh.recognition.register.register import Registration as Registration
    from simplexmesh.recognition.register.register import register as register
    from simplexmesh.recognition.sai.attribute_image import SAI as SAI
    from simplexmesh.recognition.sai.match import match as match
    from simplexmesh.recognition.sai.match_result import Match as Match
    from simplexmesh.recognition.sai.sai import sai as sai
    from simplexmesh.recognition.scans.reconstruct import reconstruct as reconstruct
    from simplexmesh.recognition.scans.register_all import Registered as Registered
    from simplexmesh.recognition.scans.register_all import ScanPair as ScanPair
    from simplexmesh.recognition.scans.register_all import register_all as register_all
    from simplexmesh.surface.curvature.estimate import curvature as curvature
    from simplexmesh.surface.curvature.result import Curvature as Curvature
    from simplexmesh.surface.features.aligned import aligned as aligned
    from simplexmesh.surface.features.feature_lines import feature_lines as feature_lines
    from simplexmesh.surface.features.lines.network import FeatureLine as FeatureLine
    from simplexmesh.surface.features.lines.network import FeatureNetwork as FeatureNetwork
    from simplexmesh.surface.features.simplify import simplify as simplify
    from simplexmesh.surface.features.zones import zones as zones
    from simplexmesh.surface.features.zoning.result import Zones as Zones
    from simplexmesh.surface.landmarks.circle import fit_circle as fit_circle
    from simplexmesh.surface.landmarks.circle import rim_circle as rim_circle
    from simplexmesh.surface.landmarks.morphed import morphed as morphed
    from simplexmesh.surface.landmarks.snap_landmark import Landmark as Landmark
    from simplexmesh.surface.landmarks.snap_landmark import snap_landmark as snap_landmark
    from simplexmesh.surface.neighborhoods import Ball as Ball
    from simplexmesh.surface.neighborhoods import Nearest as Nearest
    from simplexmesh.surface.neighborhoods import Neighborhoods as Neighborhoods
    from simplexmesh.surface.neighborhoods import Rings as Rings
    from simplexmesh.surface.neighborhoods import ball as ball
    from simplexmesh.surface.neighborhoods import nearest as nearest
    from simplexmesh.surface.neighborhoods import rings as rings
    from simplexmesh.surface.normals.estimate import vertex_normals as vertex_normals
    from simplexmesh.surface.polyline import Polyline as Polyline
    from simplexmesh.surface.quality import aspect_ratios as aspect_ratios
    from simplexmesh.surface.saliency.hk_classes import HKClasses as HKClasses
    from simplexmesh.surface.saliency.hk_classes import hk_classes as hk_classes
    from simplexmesh.surface.saliency.level_lines import inversion_lines as inversion_lines
    from simplexmesh.surface.saliency.level_lines import level_lines as level_lines
    from simplexmesh.surface.saliency.regions import Regions as Regions
    from simplexmesh.surface.saliency.regions import regions as regions
    from simplexmesh.surface.saliency.saliency import saliency as saliency
    from simplexmesh.surface.saliency.salient_points import SalientPoints as SalientPoints
    from simplexmesh.surface.saliency.salient_points import salient_points as salient_points
    from simplexmesh.surface.spread import Spread as Spread
    from simplexmesh.surface.spread import spread as spread


def __getattr__(name: str) -> Any:
    if name in _SUBMODULES:
        value: Any = importlib.import_module(_SUBMODULES[name])
    elif name in _MODULE:
        value = getattr(importlib.import_module(_MODULE[name]), name)
    else:
        raise AttributeError(f"module 'simplexmesh' has no attribute {name!r}")
    announce_compiling()
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
