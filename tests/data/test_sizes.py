"""Surfaces of sizes whose areas leave the range of numbers are refused at every door, with the same sentence."""

import numpy as np
import pytest

import simplexmesh as sm

MESH = sm.sphere(8)
BALL = MESH.triangulated("dual")
FEW = [0, 100, 200, 300, 400]

SURFACES = {
    "points": lambda size: size * MESH.vertices,
    "triangles": lambda size: (size * BALL.vertices, BALL.faces),
    "simplex mesh": lambda size: MESH.moved(size * MESH.vertices),
}

MEASURES = {
    "curvature": sm.curvature,
    "curvature by sines": lambda surface: sm.curvature(surface, "sine"),
    "vertex_normals": sm.vertex_normals,
    "spread": sm.spread,
    "saliency": sm.saliency,
    "salient_points": sm.salient_points,
    "hk_classes": sm.hk_classes,
    "thin plate": lambda surface: sm.morphed(surface, FEW, np.zeros((5, 3)), kernel="thin_plate"),
    "morphed": lambda surface: sm.morphed(surface, [0], np.zeros((1, 3))),
}

OTHERS = {
    "points": lambda size: sm.fit_circle(size * MESH.vertices),
    "triangles": lambda size: sm.targets.Triangles((size * BALL.vertices, BALL.faces)),
    "mesh": lambda size: sm.DeformableModel(MESH.moved(size * MESH.vertices)),
}

SAID = {
    1e160: r"must be within 1e-60 and 1e\+60 in its unit of length, not reach to 9.\d+e\+159: choose another unit$",
    1e-160: r"must be within 1e-60 and 1e\+60 in its unit of length, not be 1.9\d*e-160 long: choose another unit$",
}


@pytest.mark.parametrize("size", SAID)
@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("kind", SURFACES)
def test_measures_refuse_them(kind, measure, size):
    with pytest.raises(ValueError, match="^surface " + SAID[size]):
        MEASURES[measure](SURFACES[kind](size))


@pytest.mark.parametrize("size", SAID)
@pytest.mark.parametrize("name", OTHERS)
def test_others_refuse_them(name, size):
    with pytest.raises(ValueError, match=f"^{name} " + SAID[size]):
        OTHERS[name](size)


@pytest.mark.parametrize("size", SAID)
@pytest.mark.parametrize(
    "name", ["normals", "simplex_angle", "sphere_curvature", "metric", "face_areas", "area", "volume"]
)
def test_the_geometry_of_a_mesh_refuses_them(name, size):
    mesh = MESH.moved(size * MESH.vertices)
    assert mesh.diagonal == pytest.approx(size * MESH.diagonal)
    with pytest.raises(ValueError, match="^mesh " + SAID[size]):
        getattr(mesh, name)


@pytest.mark.parametrize("size", [1e-59, 1e59])
def test_simplex_angles_do_not_depend_on_size(size):
    assert MESH.moved(size * MESH.vertices).simplex_angle == pytest.approx(MESH.simplex_angle)


@pytest.mark.parametrize("size", [1e-50, 1e50])
@pytest.mark.parametrize("kind", SURFACES)
def test_within_them_all_scales(kind, size):
    found, same = sm.curvature(SURFACES[kind](size), "sine"), sm.curvature(SURFACES[kind](1.0), "sine")
    assert size * found.mean == pytest.approx(same.mean, rel=1e-6)
    model = sm.DeformableModel(MESH.moved(size * MESH.vertices))
    *_, state = model.run(3)
    *_, known = sm.DeformableModel(MESH).run(3)
    assert state.move / size == pytest.approx(known.move)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scale", [1e-160, 1e160])
@pytest.mark.parametrize("thing", [MESH, BALL, sm.PointCloud(MESH.vertices)], ids=["mesh", "triangles", "points"])
def test_what_is_no_product_of_areas_is_known_of_any_size(thing, scale):
    found = thing.scaled(scale)
    assert found.diagonal == pytest.approx(scale * thing.diagonal)
    if thing is BALL:
        np.testing.assert_array_equal(found.faces, BALL.faces)  # not inside out


@pytest.mark.parametrize("scale", [1e-160, 1e160])
def test_targets_of_points(scale):
    with pytest.raises(ValueError, match=r"cloud must be within 1e-60 and 1e\+60 in its unit of length"):
        sm.targets.Points(scale * sm.sphere(3).vertices)


@pytest.mark.parametrize("scale", [1e100, 1e300])
def test_a_level_is_proposed_for_values_of_any_size(scale):
    values = np.random.default_rng(0).random((6, 6, 6))
    with pytest.raises(ValueError, match="Otsu's threshold would be") as found:
        sm.reconstruct(sm.Volume(scale * values))
    with pytest.raises(ValueError, match="Otsu's threshold would be") as usual:
        sm.reconstruct(sm.Volume(values))
    words = [float(str(error.value).split()[-1]) for error in (found, usual)]
    assert words[0] == pytest.approx(scale * words[1], rel=1e-3)
