"""Inputs accepted by decimation, and how its result is printed."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm

MESH = sm.torus(20, 12)
TRIANGLES = MESH.triangulated("dual")


def test_triangles_of_every_kind_are_decimated_by_their_dual(tmp_path):
    stl, model = tmp_path / "ring.stl", tmp_path / "ring.vtp"
    sm.dual(TRIANGLES).save(model)
    pv = pytest.importorskip("pyvista")
    trimesh = pytest.importorskip("trimesh")
    given = {
        "triangles": TRIANGLES,
        "pair": (TRIANGLES.vertices, TRIANGLES.faces),
        "pyvista": pv.PolyData.from_regular_faces(TRIANGLES.vertices, TRIANGLES.faces),
        "trimesh": trimesh.Trimesh(TRIANGLES.vertices, TRIANGLES.faces, process=False),
        "path of a model": model,
    }
    wanted = sm.decimate(sm.dual(TRIANGLES), vertices=200).mesh.vertices
    for name, each in given.items():
        assert np.allclose(sm.decimate(each, vertices=200).mesh.vertices, wanted, atol=1e-9), name
    given["pyvista"].save(stl)
    out = sm.decimate(str(stl), vertices=200)
    assert (out.mesh.n_vertices, out.mesh.genus, len(out.vertex_map)) == (200, 1, TRIANGLES.n_faces)


@pytest.mark.parametrize(
    ("given", "error", "says"),
    [
        (MESH.vertices, TypeError, "^surface must be a SimplexMesh or triangles, not the PointCloud: see reconstruct$"),
        (
            np.zeros((3, 3, 3)),
            TypeError,
            "^surface must be a SimplexMesh or triangles, not the Volume: see reconstruct$",
        ),
        (3, TypeError, "^surface must be a Volume, .* not int$"),
        ([], ValueError, r"^surface must have shape .*, not \(0,\)$"),
        ("nowhere.stl", OSError, "nowhere.stl"),
    ],
)
def test_what_is_no_mesh_is_refused(given, error, says):
    with pytest.raises(error, match=says):
        sm.decimate(given, vertices=200)


def test_a_file_without_a_mesh_is_refused(tmp_path):
    np.savetxt(tmp_path / "points.xyz", MESH.vertices)
    with pytest.raises(TypeError, match=r"not the PointCloud in points\.xyz: see reconstruct$"):
        sm.decimate(tmp_path / "points.xyz", vertices=200)


def test_prints_in_a_line():
    out = sm.decimate(MESH, vertices=200)
    text = repr(out)
    assert text.startswith("Decimated(SimplexMesh(200 vertices, 100 faces, genus 1, 0 holes) of 480 vertices, rms 0.")
    assert text.endswith(f"{len(out.exceptions)} exceptions)")
    assert len(text) < 160


@pytest.mark.parametrize("how", [{"vertices": 100}, {"tolerance": 1.0}])
def test_a_mesh_too_large_for_products_of_areas_is_refused(how):
    ball = sm.sphere(4)
    with pytest.raises(
        ValueError, match=r"surface must be within 1e-60 and 1e\+60 in its unit of length, not reach to 9.*"
    ):
        sm.decimate(ball.moved(1e200 * ball.vertices), **how)
