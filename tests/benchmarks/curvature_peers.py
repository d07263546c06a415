"""Mean curvature by other libraries, each with one setting for all meshes; outward normals give positive spheres."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import ModuleType

import igl
import numpy as np
import pyvista

import simplexmesh as sm

OPTIONAL = ("pymeshlab", "robust_laplacian", "trimesh", "rtree")


def along_normals(mesh: sm.TriangleMesh, force: np.ndarray) -> np.ndarray:
    """Return the lengths of mean curvature normals, negative where they point inward."""
    return np.linalg.norm(force, axis=1) * np.sign((force * mesh.vertex_normals).sum(axis=1))


def cotangents(mesh: sm.TriangleMesh) -> np.ndarray:
    """libigl's cotangents, over Voronoi cells."""
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    mass = igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_VORONOI).diagonal()
    return along_normals(mesh, -(igl.cotmatrix(vertices, faces) @ vertices) / mass[:, None] / 2)


def rings(mesh: sm.TriangleMesh, radius: int) -> np.ndarray:
    """libigl's quadrics."""
    k1, k2 = igl.principal_curvature(np.array(mesh.vertices), np.array(mesh.faces), radius, True)[2:4]
    return (k1 + k2) / 2


def vtk(mesh: sm.TriangleMesh) -> np.ndarray:
    """VTK's dihedral angles."""
    return pyvista.PolyData.from_regular_faces(np.array(mesh.vertices), np.array(mesh.faces)).curvature("mean")


def robust(laplacian: ModuleType, mesh: sm.TriangleMesh) -> np.ndarray:
    """Cotangents of the intrinsic Delaunay triangulation."""
    vertices = np.array(mesh.vertices)
    stiffness, mass = laplacian.mesh_laplacian(vertices, np.array(mesh.faces))
    return along_normals(mesh, stiffness @ vertices / mass.diagonal()[:, None] / 2)


def fitted(pymeshlab: ModuleType, method: str, mesh: sm.TriangleMesh) -> np.ndarray:
    """PyMeshLab's quadrics; those of a scale take a tenth of the diagonal."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.faces))
    scale = {"scale": pymeshlab.PercentageValue(10)} if "Scale" in method else {}
    meshes.compute_curvature_principal_directions_per_vertex(
        method=method, curvcolormethod="Mean Curvature", autoclean=False, **scale
    )
    return meshes.current_mesh().vertex_scalar_array()


def apss(pymeshlab: ModuleType, mesh: sm.TriangleMesh) -> np.ndarray:
    """PyMeshLab's algebraic point set surfaces, which return twice H."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.faces))
    meshes.compute_curvature_and_color_apss_per_vertex(filterscale=4, curvaturetype="Mean")
    return meshes.current_mesh().vertex_scalar_array() / 2


def balls(trimesh: ModuleType, mesh: sm.TriangleMesh) -> np.ndarray:
    """trimesh's measure of a ball of two edges, over the area of its disc."""
    made = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    radius = 2 * made.edges_unique_length.mean()
    return trimesh.curvature.discrete_mean_curvature_measure(made, made.vertices, radius) / (np.pi * radius**2)


def peers(libraries: dict[str, ModuleType]) -> dict[str, Callable[[sm.TriangleMesh], np.ndarray]]:
    """Return all estimators there are, by the names of `simplexmesh.bench.trials.published`."""
    found: dict[str, Callable[[sm.TriangleMesh], np.ndarray]] = {
        "libigl, cotangents and angle defect": cotangents,
        "VTK": vtk,
        "libigl, quadrics, 3 rings": partial(rings, radius=3),
        "libigl, quadrics, 5 rings": partial(rings, radius=5),
    }
    if lab := libraries.get("pymeshlab"):
        found["PyMeshLab, quadric fitting"] = partial(fitted, lab, "Quadric Fitting")
        found["PyMeshLab, quadrics at 10 %"] = partial(fitted, lab, "Scale Dependent Quadric Fitting")
        found["PyMeshLab, APSS"] = partial(apss, lab)
    if laplacian := libraries.get("robust_laplacian"):
        found["robust_laplacian"] = partial(robust, laplacian)
    if {"trimesh", "rtree"} <= set(libraries):
        found["trimesh, ball measures"] = partial(balls, libraries["trimesh"])
    return found
