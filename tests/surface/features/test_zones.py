"""Zones: what they are, where they end, edits, files."""

from __future__ import annotations

import json

import numpy as np
import pytest
import pyvista as pv
import trimesh
from manifold3d import Manifold
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import Delaunay

import simplexmesh as sm
from simplexmesh.surface.features.zoning.bending import bending
from simplexmesh.surface.features.zoning.edits import by_size
from simplexmesh.surface.features.zoning.result import zoned
from tests.nightly.marks import nightly
from tests.recognition.reference import random_rotation
from tests.surface.features.parts import noisy, tessellated
from tests.surface.features.reference import Reference
from tests.surface.features.scoring import rand_index
from tests.surface.features.sheets import folded, mean_edge, shaken, sheet
from tests.surface.features.solids import Solid, box, profile

CUBE = sm.divided(pv.Cube().triangulate().clean(), 0.15)
CAN = sm.divided(pv.Cylinder(resolution=48, radius=1, height=2).triangulate().clean(), 0.2)
BALL = sm.sphere(16).triangulated("dual")
FADING = folded(lambda x: np.clip(40 - 80 / 3 * x, 0, None))
"""A fold of 40 degrees at x = 0 that fades to 0 where x is 1.5."""
RING = pv.ParametricTorus(crosssectionradius=0.25, u_res=160, v_res=40).triangulate().clean()

SHEETS = {
    "plane": lambda x, y: 0.3 * x - 0.2 * y,
    "cylinder": lambda x, y: np.sqrt(1 - y**2),
    "sphere": lambda x, y: np.sqrt(4 - (x - 1) ** 2 - y**2),
    "cone": lambda x, y: -np.sqrt((x + 1) ** 2 + y**2),
    "torus": lambda x, y: np.sqrt((3 + np.sqrt(1 - y**2)) ** 2 - (x - 1) ** 2),
    "free form": lambda x, y: 0.2 * np.sin(2 * x) * np.cos(2 * y),
}


SIDE = profile((0, 0), (2, 0), (2, 1), (0, 1), radii=[(k, 0.3) for k in range(4)])
SLAB = Reference("slab", [("+", Solid(SIDE, 0.6))])
"""Of 2 by 1 by 0.6, with its upright edges rounded."""


@pytest.fixture(scope="module")
def slab():
    return tessellated(SLAB, "aligned", SLAB.edge(5000)).mesh


def turned(*side):
    """The zones of a profile that turns about its axis, in single precision."""
    body = Reference("turned", [("+", Solid(profile((0, 0), *side, (0, side[-1][1]))))])
    mesh = tessellated(body, "sliver", 0.06).mesh
    return sm.zones(sm.TriangleMesh(mesh.vertices.astype(np.float32), mesh.faces))


def assert_partition(zones):
    """Check that zones have numbers from 0 on, are connected, and are the larger the lower their number."""
    assert zones.labels.shape == (zones.mesh.n_faces,)
    assert_array_equal(np.unique(zones.labels), np.arange(len(zones)))
    assert (np.diff(zones.areas) <= 1e-9 * zones.areas[0]).all()
    assert zones.areas.sum() == pytest.approx(zones.mesh.area)
    for number, patch in enumerate(zones.patches()):
        assert patch.area == pytest.approx(zones.areas[number])
        assert patch.topology.n_components == 1


class TestKinds:
    @pytest.mark.parametrize("kind", SHEETS)
    def test_of_sheets(self, kind):
        zones = sm.zones(sheet(SHEETS[kind]))
        assert zones.kinds == (kind,)
        assert zones.errors[0] > 0.01 if kind == "free form" else zones.errors[0] < 1e-6

    @pytest.mark.parametrize("noise", [*nightly(0.05), 0.1])
    @pytest.mark.parametrize(
        ("body", "kinds"),
        [
            (BALL, ["sphere"]),
            (sm.torus(100, 40).triangulated("dual"), ["torus"]),
            (CAN, ["cylinder", "plane", "plane"]),
            (CUBE, ["plane"] * 6),
            (sm.TriangleMesh(BALL.vertices * [1, 1.5, 2], BALL.faces), ["free form"]),
        ],
        ids=["ball", "ring", "can", "cube", "egg"],
    )
    def test_of_noisy_bodies(self, body, kinds, noise):
        zones = sm.zones(shaken(body, noise))
        assert list(zones.kinds) == kinds
        if kinds != ["free form"]:
            assert_allclose(zones.errors, noise * mean_edge(body), rtol=0.3)

    def test_of_zones_without_vertices_inside(self):
        assert sm.zones(pv.Cube().triangulate().clean()).kinds == ("plane",) * 6
        assert sm.zones(pv.Cylinder(resolution=60).triangulate().clean()).kinds == ("cylinder", "plane", "plane")

    @pytest.mark.parametrize("drop", [0.02, 0.1, 0.5])
    def test_of_chamfers_between_two_circles_which_are_on_a_sphere_too(self, drop):
        pin = turned((1, 0), (1, 2), (1 - drop, 2 + drop))
        assert sorted(pin.kinds) == ["cone", "cylinder", "plane", "plane"]

    def test_of_drafts_of_a_degree(self):
        assert sorted(turned((1, 0), (1 - np.tan(np.radians(1)), 1)).kinds) == ["cone", "plane", "plane"]

    @pytest.mark.parametrize("degrees", [0.2, 2.0])
    @pytest.mark.parametrize("rows", [2, 3])
    def test_of_drafts_in_some_rows(self, degrees, rows):
        """Cylinders and spheres are within a thousandth of them."""
        heights = np.linspace(0, 1, rows)
        zones = turned(*zip(1 - heights * np.tan(np.radians(degrees)), heights, strict=True))
        assert sorted(zones.kinds) == ["cone", "plane", "plane"]

    @pytest.mark.parametrize("seed", range(5))
    def test_of_flat_faces_with_few_corners_in_digits_of_a_file(self, seed):
        """On which cones are, to these digits, whose six parameters are as many as there are corners."""
        rng = np.random.default_rng(seed)
        for count in (7, 8, 9, 10):
            angles = 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
            outline = 6.0 * np.column_stack([np.cos(angles), np.sin(angles)])
            prism = trimesh.creation.extrude_triangulation(outline, Delaunay(outline).simplices, 5.0)
            corners = np.round(prism.vertices @ random_rotation(rng).T, 3)
            assert "cone" not in sm.zones(sm.TriangleMesh(corners, prism.faces)).kinds

    @pytest.mark.parametrize("segments", [16, 20, 24])
    def test_of_bored_balls_whose_rims_are_on_chords(self, segments):
        ball = Manifold.sphere(1, segments).rotate((20, 30, 0)) - Manifold.cylinder(4, 0.3, -1, 64, center=True)
        solid = ball.trim_by_plane((0.3, 0.5, 1), -0.5).to_mesh64()
        zones = sm.zones(sm.TriangleMesh(solid.vert_properties[:, :3], solid.tri_verts))
        assert zones.kinds[0] == "sphere"
        assert zones.errors[0] < 1e-6

    def test_of_faces_with_most_vertices_on_a_part_of_them(self):
        domed = profile((0, 0), (1, 0), (1, 2), (0, 2), radii=[(2, 1 - 1e-9)])
        assert sorted(sm.zones(tessellated(Reference("domed", [("+", Solid(domed))]), "sliver", 0.06).mesh).kinds) == [
            "free form",
            "plane",
        ]

    @pytest.mark.parametrize(("kind", "bulge"), [("cone", 0.0), ("sphere", np.tan(np.pi / 16))])
    def test_of_noisy_bands(self, kind, bulge):
        side = np.array([[0, 0, 0], [1, 0, bulge], [np.sqrt(0.5), np.sqrt(0.5), 0], [0, np.sqrt(0.5), 0]])
        body = Reference("band", [("+", Solid(side))])
        zones = sm.zones(noisy(tessellated(body, "aligned", body.edge(800)), 0.06).mesh)
        assert sorted(zones.kinds) == sorted([kind, "plane", "plane"])

    def test_of_files_in_single_precision(self):
        assert sm.zones(RING).kinds == ("torus",)
        assert sm.zones(pv.Sphere()).kinds == ("sphere",)


class TestWhereZonesEnd:
    @pytest.mark.parametrize("body", [CUBE, CAN, folded(40)])
    def test_at_lines(self, body):
        network = sm.feature_lines(body)
        zones = sm.zones(body, network)
        assert_partition(zones)
        assert [line.length for line in zones.network.lines] == [line.length for line in network.lines]
        assert_array_equal(zones.labels, sm.zones(body).labels)

    def test_one_of_each_component_without_lines(self):
        zones = sm.zones(BALL.to_pyvista() + pv.Sphere(radius=0.4, center=(5, 0, 0)))
        assert len(zones) == 2
        assert zones.kinds == ("sphere", "sphere")
        assert zones.boundaries == ()

    @pytest.mark.parametrize("kind", ["aligned", *nightly("irregular")])
    def test_where_the_curvature_is_another(self, kind):
        body = tessellated(SLAB, kind, SLAB.edge(5000)).mesh
        assert len(sm.zones(body).without_small(faces=20)) == 3
        assert len(sm.zones(body, tolerance=100.0)) < 6
        zones = sm.zones(body, tolerance=2.0)
        assert_partition(zones)
        large = zones.without_small(faces=100)
        flat = np.array(large.kinds) == "plane"
        assert len(large) == 10
        assert set(large.kinds) == {"plane", "cylinder"}
        assert_allclose(large.areas[flat], [1.923, 1.923, 0.84, 0.84, 0.24, 0.24], atol=0.15)
        assert_allclose(large.areas[~flat], 4 * [0.283], atol=0.1)

    @pytest.mark.parametrize(("tolerance", "error"), [(0, ValueError), (-1, ValueError), ("1", TypeError)])
    def test_at_a_tolerance_above_zero(self, tolerance, error):
        with pytest.raises(error, match="tolerance"):
            sm.zones(CUBE, tolerance=tolerance)

    def test_not_at_lines_of_another_surface(self):
        with pytest.raises(ValueError, match="network must be one of this surface"):
            sm.zones(CUBE, sm.feature_lines(CAN))
        with pytest.raises(TypeError, match="network"):
            sm.zones(CUBE, CUBE)


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize(("kind", "curvature"), [("plane", 0.0), ("cylinder", 1.0), ("sphere", np.sqrt(0.5))])
def test_bending_is_that_of_the_surface(kind, curvature, noise):
    network = sm.feature_lines(shaken(sheet(SHEETS[kind]), noise))
    found = bending(network._found, np.zeros(network.mesh.n_faces, int))
    inner = np.abs(network.mesh.vertices[network.mesh.faces][:, :, 1]).max(axis=1) < 0.6
    assert np.median(found[inner]) == pytest.approx(curvature, rel=0.15, abs=0.3)


class TestBoundaries:
    def test_are_sharp_between_the_sides_of_a_cube(self):
        zones = sm.zones(CUBE)
        assert len(zones.boundaries) == 12
        assert len({pair for _, pair in zones.boundaries}) == 12
        for line, pair in zones.boundaries:
            assert (line.kind, line.length) == ("C0", pytest.approx(1))
            assert_array_equal(pair, np.sort(pair))

    def test_are_smooth_elsewhere(self, slab):
        zones = sm.zones(slab, tolerance=1.5)
        length = {kind: sum(line.length for line, _ in zones.boundaries if line.kind == kind) for kind in ("C0", "Gn")}
        assert length["C0"] == pytest.approx(2 * (6 - (8 - 2 * np.pi) * 0.3), rel=0.01)
        assert length["Gn"] > 8 * 0.6
        assert all(one != other for line, (one, other) in zones.boundaries if line.kind == "Gn")

    def test_have_one_zone_on_both_sides_where_a_line_ends_in_it(self):
        zones = sm.zones(FADING)
        assert [pair for _, pair in zones.boundaries] == [(0, 0)]


class TestEdits:
    def test_merged(self):
        zones = sm.zones(CAN)
        merged = zones.merged(1, 0)
        assert_partition(merged)
        assert len(merged) == 2
        assert_allclose(merged.areas, [zones.areas[:2].sum(), zones.areas[2]])
        assert_array_equal(zones.merged(np.array([1, 0])).labels, merged.labels)
        assert len(zones) == 3
        for wrong, error, text in (
            ((0,), ValueError, "at least two"),
            ((0, 0), ValueError, "at least two"),
            ((1, 2), ValueError, "touch"),
            ((0, 3), ValueError, "zone"),
            ((0, 1.0), TypeError, "zone"),
        ):
            with pytest.raises(error, match=text):
                zones.merged(*wrong)

    def test_without(self):
        zones = sm.zones(CUBE)
        fewer = zones.without(0)
        assert_partition(fewer)
        assert len(fewer) == 5
        assert fewer.areas.sum() == pytest.approx(6)
        assert len(zones.without(*range(1, 6))) == 1
        assert_array_equal(zones.without([0, 1]).labels, zones.without(0, 1).labels)
        with pytest.raises(ValueError, match="zones must be left"):
            zones.without(*range(6))
        with pytest.raises(TypeError, match="zone must be a whole number, not str 'a'"):
            zones.without(["a"])
        with pytest.raises(ValueError, match="zone"):
            zones.without(6)

    def test_without_a_fillet_gives_it_to_the_sides_between_sharp_edges(self, slab):
        zones = sm.zones(slab, tolerance=2.0).without_small(faces=100)
        fewer = zones.without(*(k for k, kind in enumerate(zones.kinds) if kind == "cylinder"))
        assert_allclose(fewer.areas[:2], zones.areas[:2])
        assert len(fewer) == 6

    def test_without_small(self, slab):
        zones = sm.zones(slab, tolerance=1.5)
        fewer = zones.without_small(faces=300)
        assert_partition(fewer)
        assert len(fewer) < len(zones)
        assert np.bincount(fewer.labels).min() >= 300
        assert_array_equal(zones.without_small(faces=1).labels, zones.labels)
        assert len(sm.zones(CUBE).without_small(faces=10**6)) == 1
        for wrong, error in ((0, ValueError), (2.0, TypeError)):
            with pytest.raises(error, match="faces"):
                zones.without_small(faces=wrong)

    def test_small_zones_go_to_the_smallest_first(self):
        network = sm.feature_lines(pv.Plane(i_resolution=9, j_resolution=1).triangulate())
        along = network.mesh.vertices[network.mesh.faces].mean(axis=1)[:, 0]
        zones = zoned(network, np.repeat([0, 1, 2], [10, 2, 6])[np.argsort(np.argsort(along))])
        assert np.bincount(zones.without_small(faces=7).labels).tolist() == [11, 7]
        assert len(zones.without_small(faces=9)) == 1

    def test_grown(self, slab):
        zones = sm.zones(slab, tolerance=1.5)
        number = 2
        assert zones.areas[2] < 0.9
        grown = zones.grown(number, tolerance=10.0)
        assert_partition(grown)
        assert len(grown) == 3
        around = 0.6 * (6 - (8 - 2 * np.pi) * 0.3)
        assert grown.areas[0] == pytest.approx(around, rel=0.01)
        assert_array_equal(zones.grown(0, tolerance=1e-3).labels == 0, zones.labels == 0)
        with pytest.raises(ValueError, match="zone"):
            zones.grown(99, tolerance=1.0)
        with pytest.raises(ValueError, match="tolerance"):
            zones.grown(0, tolerance=0)

    def test_smoothed(self, slab):
        zones = sm.zones(slab, tolerance=1.5)
        smooth = zones.smoothed()
        assert_partition(smooth)

        def length(of, kind):
            return sum(line.length for line, _ in of.boundaries if line.kind == kind)

        assert length(smooth, "Gn") < 0.97 * length(zones, "Gn")
        assert length(smooth, "C0") == pytest.approx(length(zones, "C0"), rel=0.01)
        assert_array_equal(sm.zones(CUBE).smoothed().labels, sm.zones(CUBE).labels)


class TestFiles:
    def test_vtp(self, tmp_path):
        zones = sm.zones(CAN)
        zones.save(tmp_path / "zones.vtp")
        read = pv.read(tmp_path / "zones.vtp")
        of_lines = read.cell_data["line"] >= 0
        assert_array_equal(read.cell_data["zone"][~of_lines], zones.labels)
        assert_array_equal(read.cell_data["zones"][of_lines], [pair for _, pair in zones.boundaries])
        assert_array_equal(read.regular_faces, zones.mesh.faces)
        assert_array_equal(read.points[: CAN.n_vertices], zones.mesh.vertices)
        assert [read.field_data["kinds"][k] for k in read.cell_data["kind"][of_lines]] == ["C0", "C0"]
        assert read.n_lines == 2

    def test_json(self, tmp_path):
        zones = sm.zones(CAN)
        zones.save(tmp_path / "zones.json")
        told = json.loads((tmp_path / "zones.json").read_text())
        assert [row["kind"] for row in told["zones"]] == ["cylinder", "plane", "plane"]
        assert_allclose([row["area"] for row in told["zones"]], zones.areas)
        assert_allclose([row["rms"] for row in told["zones"]], zones.errors)
        assert [row["triangles"] for row in told["zones"]] == np.bincount(zones.labels).tolist()
        assert told["labels"] == zones.labels.tolist()
        assert [row["zones"] for row in told["boundaries"]] == [[0, 1], [0, 2]]
        assert [row["closed"] for row in told["boundaries"]] == [True, True]
        assert [row["nodes"] for row in told["boundaries"]] == [[], []]

    def test_json_of_lines(self, slab):
        scanned = Reference("box", [("+", box((0, 0, 0), (1, 1, 0.8)))])
        for body in (CUBE, tessellated(scanned, "scan", 0.05).mesh):
            told = sm.zones(body).as_dict()
            assert len(told["nodes"]) == 8
            for row in told["boundaries"]:
                assert_allclose(np.array(told["nodes"])[row["nodes"]], np.array(row["points"])[[0, -1]])
                assert np.median(row["angle"]) == pytest.approx(np.pi / 2, abs=0.02)
        zones = sm.zones(slab, tolerance=1.5)
        kinds = [row["kind"] for row in zones.as_dict()["boundaries"]]
        assert kinds == [line.kind for line, _ in zones.boundaries]
        assert set(kinds) == {"C0", "Gn"}
        (row,) = sm.zones(FADING).as_dict()["boundaries"]
        assert np.corrcoef(np.array(row["points"])[:, 0], row["angle"])[0, 1] < -0.9

    def test_stl(self, tmp_path):
        zones = sm.zones(CUBE)
        zones.save(tmp_path / "part.stl")
        read = [pv.read(tmp_path / f"part_{k}.stl") for k in range(6)]
        assert len(list(tmp_path.iterdir())) == 6
        assert_allclose([each.area for each in read], zones.areas, rtol=1e-5)

    def test_of_another_kind_are_refused(self, tmp_path):
        with pytest.raises(ValueError, match=r"\.vtp, \.json or \.stl"):
            sm.zones(CUBE).save(tmp_path / "zones.obj")
        assert list(tmp_path.iterdir()) == []


def test_patches_keep_unit_and_data():
    mesh = sm.TriangleMesh(CUBE.vertices, CUBE.faces, {"height": CUBE.vertices[:, 2]}, "mm")
    for patch in sm.zones(mesh).patches():
        assert patch.unit == "mm"
        assert_array_equal(patch.data["height"], patch.vertices[:, 2])


class TestStraddlingTriangles:
    """Triangles of scans lie to both sides of the lines, which follow their edges."""

    @pytest.mark.parametrize("noise", [0.0, 0.1])
    def test_are_in_the_zone_on_their_side(self, noise):
        part = noisy(tessellated(SLAB, "scan", SLAB.edge(8000)), noise)
        zones = sm.zones(part.mesh)
        across = zones.network._found.edges.zones(zones.network._chosen)
        assert rand_index(zones.labels, part.patches) > 0.97
        assert np.sum(zones.labels != zones._parts) > 100
        assert 1 - rand_index(zones.labels, part.patches) < 0.6 * (1 - rand_index(across, part.patches))
        assert_partition(zones)

    def test_are_none_where_the_mesh_follows_its_creases(self):
        zones = sm.zones(tessellated(SLAB, "aligned", SLAB.edge(5000)).mesh)
        assert_array_equal(zones.labels, zones._parts)


@pytest.mark.parametrize("step", [0.2, *nightly(0.1, 0.5)])
def test_vertices_at_one_place_are_no_harm(step):
    """As in files of few digits: edges have no length, triangles no area, and nor have some zones."""
    ball = sm.sphere(8).triangulated()
    places = ball.vertices + np.random.default_rng(0).normal(0, 0.02, ball.vertices.shape)
    zones = sm.zones((step * np.round(places / step), ball.faces))
    assert_partition(zones)
    assert len(zones.kinds) == len(zones)


def test_zones_without_area_come_before_labels_without_triangles():
    assert_array_equal(by_size(np.array([3, 1, 3]), np.array([1.0, 0.0, 1.0]))[[3, 1]], [0, 1])
