"""Saliency, salient points and kinds of surface of real scans: what a person sees there."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.surface.sampled_surface import as_sampled_surface

pytestmark = pytest.mark.filterwarnings("ignore::simplexmesh.SimplexMeshWarning")


@pytest.fixture(scope="module")
def measured(data_folder):
    """A scan and its curvature, measured once."""
    kept = {}

    def of(name):
        if name not in kept:
            mesh = sm.read_triangles(data_folder / name)
            if name == "fran_face.vtk":  # its faces look inward
                mesh = sm.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
            kept[name] = mesh, sm.curvature(mesh)
        return kept[name]

    return of


SCANS = ["lion_head.off", "femur.off", "fran_face.vtk", "rabbit_scan.vtk", "part_scan.ply"]


@pytest.mark.parametrize("name", SCANS)
def test_everything_is_known_and_few_places_are_salient(measured, name):
    mesh, curvature = measured(name)
    found = sm.saliency(mesh, curvature=curvature)
    assert np.isfinite(found).all()
    assert 0 <= found.min() < found.max() < np.pi
    assert np.percentile(found, 99) > 3 * np.median(found)
    points = sm.salient_points(mesh, curvature=curvature)
    assert 1 <= len(points) < 0.02 * mesh.n_vertices


@pytest.mark.parametrize("name", [name for name in SCANS if name != "femur.off"])
def test_rims_are_not_salient(measured, name):
    mesh, curvature = measured(name)
    found = sm.saliency(mesh, curvature=curvature)
    rim = ~as_sampled_surface(mesh).one_ring.closed
    assert rim.sum() > 20
    assert np.median(found[rim]) < 2.5 * np.median(found[~rim])
    assert rim[np.argsort(-found)[:20]].mean() < 0.5


def test_the_tip_of_the_nose_is_found(measured):
    mesh, curvature = measured("fran_face.vtk")
    nose = mesh.vertices[:, 0] == mesh.vertices[:, 0].max()
    tip = mesh.vertices[nose].mean(axis=0)
    found = sm.salient_points(mesh, of="mean", curvature=curvature, count=3)
    assert np.linalg.norm(found.points - tip, axis=1).min() < 0.06 * mesh.diagonal


def test_the_head_of_the_femur_is_a_peak_and_its_shaft_is_not(measured):
    mesh, curvature = measured("femur.off")
    kinds = sm.hk_classes(mesh, curvature=curvature)
    x, _, z = mesh.vertices.T
    head = (z < np.percentile(z, 12)) & (x > 0.05)
    named = [kinds.names[k] for k in np.bincount(kinds.labels[head]).argsort()[::-1]]
    assert named[0] == "peak"
    shaft = (z > 0) & (z < 0.4)
    count = np.bincount(kinds.labels[shaft], minlength=9) / shaft.sum()
    assert count[2] + count[3] > 0.5  # a tube that is bent a little: ridge and saddle ridge


def test_specks_vanish_into_regions(measured):
    mesh, curvature = measured("lion_head.off")
    kinds = sm.hk_classes(mesh, curvature=curvature)
    raw, whole = sm.regions(mesh, kinds, minimum=0), sm.regions(mesh, kinds)
    assert len(whole) < 0.5 * len(raw)
    assert (whole.classes[whole.labels] == kinds.labels).mean() > 0.75


def test_edges_and_corners_of_the_fandisk_are_its_salient_points(measured):
    mesh, curvature = measured("fandisk.off")
    found = sm.salient_points(mesh, of="mean", curvature=curvature, count=10)
    unit = mesh.face_vectors / np.linalg.norm(mesh.face_vectors, axis=1, keepdims=True)
    for vertex in found:
        around = unit[(mesh.faces == vertex).any(axis=1)]
        ring = unit[np.isin(mesh.faces, np.append(as_sampled_surface(mesh).one_ring[vertex], vertex)).any(axis=1)]
        assert min((around @ around.T).min(), (ring @ ring.T).min()) < 0.5  # faces that meet at 60 degrees or more
