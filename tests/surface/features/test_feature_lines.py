"""Lines of surfaces known in closed form, whatever their pose, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from skimage.measure import marching_cubes

import simplexmesh as sm
from simplexmesh.data.conversion import as_triangles
from simplexmesh.mesh import manifold
from simplexmesh.surface.features.lines import creases
from simplexmesh.surface.features.lines.edge_sets import Edges
from simplexmesh.surface.features.lines.facets import measured
from simplexmesh.surface.features.lines.normals import sampled
from simplexmesh.surface.features.lines.residuals import residual_noise
from tests.nightly.marks import nightly
from tests.surface.features.sheets import folded, mean_edge, shaken, sheet


def prism(sides, edge=0.2):
    """A regular prism of radius 1 and height 2."""
    return sm.divided(pv.Cylinder(resolution=sides, radius=1, height=2).triangulate().clean(), edge)


CUBE = sm.divided(pv.Cube().triangulate().clean(), 0.15)
CAN = sm.divided(pv.Cylinder(resolution=48, radius=1, height=2).triangulate().clean(), 0.2)
BALL = sm.sphere(16).triangulated("dual")
RING = sm.torus(140, 60).triangulated("dual")
FINE = sm.sphere(30).triangulated("dual")
FADING = folded(lambda x: np.clip(40 - 80 / 3 * x, 0, None))
"""A fold of 40 degrees that fades to 0 where x is 1.5."""


class TestClosedForms:
    @pytest.mark.parametrize("sides", [3, 5, 6, 8])
    def test_prism(self, sides):
        network = sm.feature_lines(prism(sides))
        side = 2 * np.sin(np.pi / sides)
        expected = [2.0] * sides + [side] * 2 * sides
        assert_allclose([line.length for line in network.lines], expected, rtol=1e-6)
        assert len(network.nodes) == 2 * sides
        assert not any(line.closed for line in network.lines)
        for line in network.lines:
            turned = 2 * np.pi / sides if line.length > 1.9 else np.pi / 2
            assert_allclose(line.angle[1:-1], turned, rtol=1e-6)

    @pytest.mark.parametrize(
        ("name", "lines", "nodes", "angle"),
        [
            ("tetrahedron", 6, 4, np.arccos(-1 / 3)),
            ("octahedron", 12, 6, np.arccos(1 / 3)),
            ("dodecahedron", 30, 20, np.arctan(2)),
            ("icosahedron", 30, 12, np.arccos(np.sqrt(5) / 3)),
        ],
    )
    def test_platonic_solid(self, name, lines, nodes, angle):
        body = sm.divided(pv.PlatonicSolid(name).triangulate().clean(), 0.15)
        network = sm.feature_lines(body)
        assert (len(network.lines), len(network.nodes)) == (lines, nodes)
        for line in network.lines:
            assert_allclose(line.angle, angle, rtol=1e-5)
            assert line.length == pytest.approx(np.linalg.norm(line.points[-1] - line.points[0]), rel=1e-6)

    @pytest.mark.parametrize(
        ("name", "lines", "zones"),
        [
            ("tetrahedron", 6, 4),
            ("cube", 12, 6),
            ("octahedron", 12, 8),
            ("icosahedron", 30, 20),
            ("dodecahedron", 30, 12),
        ],
    )
    def test_platonic_solid_of_few_triangles(self, name, lines, zones):
        body = pv.PlatonicSolid(name).triangulate().clean()
        network = sm.feature_lines(body)
        assert (len(network.lines), len(network.nodes), network.noise) == (
            lines,
            2 + lines - zones,
            pytest.approx(0, abs=1e-5),
        )
        assert sm.zones(body, network).kinds == ("plane",) * zones

    def test_a_pyramid_of_ten_triangles(self):
        turn = np.arange(6) * np.pi / 3
        base = [[0, k + 1, k] for k in range(1, 5)]
        sides = [[k, (k + 1) % 6, 6] for k in range(6)]
        corners = np.vstack([np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]), [0, 0, 1]])
        network = sm.feature_lines(sm.TriangleMesh(corners, base + sides))
        assert (len(network.lines), len(network.nodes), network.noise) == (12, 7, 0)

    def test_a_sheet_of_few_triangles_has_noise_but_no_lines(self):
        x, y = np.meshgrid(np.arange(5.0), np.arange(5.0))
        points = np.column_stack([x.ravel(), y.ravel(), 0.1 * np.random.default_rng(0).normal(size=25)])
        at = np.arange(20).reshape(4, 5)[:, :4].ravel()
        faces = np.concatenate([np.stack([at, at + 1, at + 6], axis=1), np.stack([at, at + 6, at + 5], axis=1)])
        network = sm.feature_lines(sm.TriangleMesh(points, faces))
        assert network.lines == ()
        assert network.noise > 0.03

    @pytest.mark.parametrize("bend", [8, 20, 40, 90])
    def test_fold(self, bend):
        (line,) = sm.feature_lines(folded(bend), angle=np.radians(5)).lines
        assert line.length == pytest.approx(2, rel=1e-6)
        assert_allclose(line.points[:, 1:], 0, atol=1e-6)
        assert_allclose(np.degrees(line.angle), bend, rtol=1e-6)

    @pytest.mark.parametrize("body", [CAN, pv.Cylinder(resolution=60, radius=1, height=2).triangulate().clean()])
    def test_can(self, body):
        network = sm.feature_lines(body)
        assert [line.closed for line in network.lines] == [True, True]
        assert len(network.nodes) == 0
        for line in network.lines:
            assert line.length == pytest.approx(2 * np.pi, rel=2e-3)
            assert_allclose(line.angle, np.pi / 2, atol=0.01)
            assert line.kind == "C0"

    @pytest.mark.parametrize("sides", [1, 3, 4, 6])
    def test_the_twelve_triangles_of_a_box_or_as_few_of_a_prism(self, sides):
        body = pv.Box((0, 1, 0, 2, 0, 3)) if sides == 1 else pv.Cylinder(resolution=sides, radius=1, height=2)
        network = sm.feature_lines(body.triangulate().clean())
        sides = 4 if sides == 1 else sides
        assert (len(network.lines), len(network.nodes)) == (3 * sides, 2 * sides)

    @pytest.mark.parametrize("sides", [(10, 10, 1), (142, 75, 1), (3, 35, 3), (0.4, 12, 0.4)])
    def test_the_twelve_triangles_of_a_thin_plate_or_rod(self, sides):
        ends = np.column_stack([np.zeros(3), sides]).ravel()
        network = sm.feature_lines(pv.Box(ends).triangulate().clean())
        assert (len(network.lines), len(network.nodes)) == (12, 8)

    def test_angles_at_nodes_are_those_of_the_line(self):
        upright = [line for line in sm.feature_lines(prism(3)).lines if line.length > 1.9]
        assert_allclose([line.angle[[0, -1]] for line in upright], 2 * np.pi / 3, rtol=1e-6)


class TestNothingSharp:
    @pytest.mark.parametrize("noise", [0.0, *nightly(0.05, 0.1), 0.2])
    @pytest.mark.parametrize(
        "body",
        [
            BALL,
            as_triangles(pv.ParametricTorus(crosssectionradius=0.4, u_res=120, v_res=80).triangulate(), "torus"),
            sm.TriangleMesh(BALL.vertices * [1, 1, 1.5], BALL.faces),
            sheet(lambda x, y: 0.2 * np.sin(2 * x) * np.cos(2 * y)),
        ],
        ids=["sphere", "torus", "ellipsoid", "waves"],
    )
    def test_smooth_surfaces(self, body, noise):
        network = sm.feature_lines(shaken(body, noise))
        assert network.lines == ()
        assert network.nodes.shape == (0, 3)
        assert len(network.without()) == 0

    @pytest.mark.parametrize("step", [0.1, 0.2])
    @pytest.mark.parametrize("shape", [(1, 1, 1), (1, 0.6, 2)], ids=["sphere", "egg"])
    def test_smooth_surfaces_of_rounded_coordinates(self, shape, step):
        length = step * mean_edge(FINE)
        network = sm.feature_lines((np.round(FINE.vertices * shape / length) * length, FINE.faces))
        assert network.lines == ()
        assert 0.6 * length < np.sqrt(12) * network.noise < 1.001 * length

    @pytest.mark.parametrize("resolution", [24, 40])
    def test_a_capsule_whose_ends_go_on_smoothly(self, resolution):
        capsule = pv.Capsule(radius=0.5, cylinder_length=1.5, resolution=resolution).triangulate().clean()
        assert sm.feature_lines(capsule).lines == ()

    @pytest.mark.parametrize("tolerance", [0.002, 0.005, 0.01])
    def test_a_knotted_tube_that_is_simplified(self, tolerance):
        turn = np.linspace(0, 2 * np.pi, 301)
        far, height = 2 + np.cos(3 * turn), np.sin(3 * turn)
        course = pv.Spline(np.column_stack([np.cos(2 * turn) * far, np.sin(2 * turn) * far, height]), 300)
        tube = course.tube(radius=0.4, n_sides=24).triangulate().clean()
        assert sm.feature_lines(sm.simplify(tube, tolerance=tolerance * tube.length)).lines == ()

    def test_a_border_is_no_crease(self):
        assert sm.feature_lines(sheet(lambda x, y: 0 * x)).lines == ()
        keep = (CUBE.vertices[CUBE.faces][:, :, 2] < 0.4999).any(axis=1)
        network = sm.feature_lines(sm.TriangleMesh(CUBE.vertices, CUBE.faces[keep]))
        assert sum(line.length for line in network.lines) == pytest.approx(8, rel=1e-6)
        assert len(network.lines) == 8


class TestNoise:
    @pytest.mark.parametrize(("bend", "noise"), [(20, 0.05), (40, 0.1), (90, 0.2)])
    def test_a_fold_is_found(self, bend, noise):
        for seed in range(3):
            network = sm.feature_lines(shaken(folded(bend), noise, seed))
            assert sum(line.length for line in network.lines) == pytest.approx(2, rel=0.15)
            angle = np.concatenate([line.angle for line in network.lines])
            assert np.degrees(np.median(angle)) == pytest.approx(bend, rel=0.2)

    @pytest.mark.parametrize("noise", [0.05, 0.1, 0.2])
    def test_is_estimated(self, noise):
        for seed, body in enumerate([folded(40), CAN, CUBE, BALL]):
            known = noise * mean_edge(body)
            assert sm.feature_lines(shaken(body, noise, seed)).noise == pytest.approx(known, rel=0.25)

    @pytest.mark.parametrize("noise", [0.05, *nightly(0.1)])
    def test_is_not_taken_for_creases_at_any_angle(self, noise):
        for seed in range(4):
            for angle in np.radians([2, 4]):
                assert sm.feature_lines(shaken(BALL, noise, seed), angle=angle).lines == ()

    @pytest.mark.parametrize("axis", [0, 2])
    def test_of_half_a_surface_is_seen_there(self, axis):
        known = 0.1 * mean_edge(RING)
        moves = np.random.default_rng(0).normal(0, known, RING.vertices.shape) * (RING.vertices[:, axis : axis + 1] > 0)
        network = sm.feature_lines((RING.vertices + moves, RING.faces))
        place, told = RING.vertices[RING.faces].mean(axis=1)[:, axis], network._found.edges.facets.noise
        assert np.median(told[place > 0.1]) == pytest.approx(known, rel=0.25)
        assert np.median(told[place < -0.1]) < 0.35 * known

    def test_is_that_of_vertices_beside_exact_planes_of_a_third_of_the_area(self):
        ball, box = shaken(BALL, 0.05), pv.Cube(center=(5, 0, 0), x_length=1.2).triangulate().clean()
        faces = np.concatenate([ball.faces, box.regular_faces + ball.n_vertices])
        network = sm.feature_lines((np.concatenate([ball.vertices, box.points]), faces))
        assert network.noise == pytest.approx(0.05 * mean_edge(BALL), rel=0.25)

    @pytest.mark.parametrize("noise", [0.0, 0.02, 0.2])
    def test_is_what_vertices_are_off_quadrics(self, noise):
        """However much and whichever way edges bend."""
        body = shaken(sheet(lambda x, y: 0.5 * x**2 - x * y - 0.3 * y**2), noise)
        network = sm.feature_lines(body)
        told = residual_noise(network._found.edges.facets)
        assert told == pytest.approx(noise * mean_edge(body), rel=0.15, abs=1e-3 * mean_edge(body))

    def test_of_half_a_surface_is_no_crease_there(self):
        body = sm.divided(pv.Cube().triangulate().clean(), 0.06)
        noise = 0.2 * mean_edge(body) * (body.vertices[:, :1] > 0)
        found = []
        for seed in range(3):
            moves = noise * np.random.default_rng(seed).normal(size=body.vertices.shape)
            found.append(len(sm.feature_lines((body.vertices + moves, body.faces))))
        assert sum(found) <= 38  # of 36

    def test_without_noise_none_is_estimated(self):
        assert sm.feature_lines(CUBE).noise < 1e-12

    def test_whole_numbers_are_no_noise(self):
        network = sm.feature_lines((np.round(16 * CUBE.vertices), CUBE.faces))
        assert network.noise < 1e-12
        assert len(network) == 12


class TestInvariance:
    @pytest.mark.parametrize("seed", [*nightly(0), 1, *nightly(2, 3)])
    @pytest.mark.parametrize(("body", "noise"), [(CUBE, 0.0), (CAN, 0.1), (folded(40), 0.05), (prism(5), 0.1)])
    def test_to_poses_units_and_the_order_of_vertices_and_triangles(self, body, noise, seed):
        rng, mesh = np.random.default_rng(seed), shaken(body, noise)
        turn, unit, move = Rotation.random(random_state=rng), (1e-6, 1e6, 25.4, 1.0)[seed], rng.normal(size=3)
        order, rows = rng.permutation(mesh.n_vertices), rng.permutation(mesh.n_faces)
        faces = np.roll(np.argsort(order)[mesh.faces[rows]], seed, axis=1)
        given = sm.TriangleMesh(unit * (turn.apply(mesh.vertices[order]) + move), faces)
        one, two = sm.feature_lines(mesh), sm.feature_lines(given)
        assert len(one.lines) == len(two.lines)
        assert_allclose([line.length * unit for line in one.lines], [line.length for line in two.lines], rtol=0.02)
        assert two.noise == pytest.approx(one.noise * unit, rel=1e-6, abs=1e-12 * unit)
        mean = [np.median(np.concatenate([line.angle for line in net.lines])) for net in (one, two)]
        assert mean[1] == pytest.approx(mean[0], rel=0.02)

    def test_components_have_the_lines_that_each_one_has(self):
        other = sm.TriangleMesh(CAN.vertices + np.array([5, 0, 0]), CAN.faces)
        both = sm.feature_lines(pv.merge([CUBE.to_pyvista(), other.to_pyvista()], merge_points=False))
        assert sum(line.closed for line in both.lines) == 2
        assert len(both.lines) == 14


class TestAngle:
    @pytest.mark.parametrize(("angle", "lines"), [(None, 36), (0.4, 36), (0.65, 2), (1.4, 2), (1.7, 0)])
    def test_leaves_lines_of_less(self, angle, lines):
        """Twelve sides meet at 30 degrees, and the bases at 90."""
        assert len(sm.feature_lines(prism(12), angle=angle)) == lines

    @pytest.mark.parametrize("noise", [0.0, 0.05])
    def test_lines_end_where_a_crease_fades(self, noise):
        (line,) = sm.feature_lines(shaken(FADING, noise)).lines
        start, end = np.sort(line.points[[0, -1], 0])
        assert start == pytest.approx(0, abs=0.03)
        assert 0.6 < end < 1.35  # between 24 and 4 degrees
        assert np.abs(line.points[:, 1]).max() < 0.1

    @pytest.mark.parametrize("angle", [0, np.pi, 45, -0.1, 4.0])
    def test_must_be_of_radians(self, angle):
        with pytest.raises(ValueError, match="radians"):
            sm.feature_lines(CUBE, angle=angle)
        with pytest.raises(ValueError, match="radians"):
            sm.feature_lines(FADING).prolonged(0, angle=angle)

    @pytest.mark.parametrize(("angle", "error"), [(np.nan, ValueError), ("0.5", TypeError), ([0.5], TypeError)])
    def test_must_be_a_number(self, angle, error):
        with pytest.raises(error, match="angle"):
            sm.feature_lines(CUBE, angle=angle)


def test_slivers_of_marching_cubes_are_hardly_ever_of_the_shape():
    """A box with a bore has 14 lines; each sliver that counts adds two."""
    lines, lengths = [], []
    for seed in range(6):
        turn = Rotation.random(rng=seed).as_matrix()
        at = np.stack(np.meshgrid(*[np.linspace(-2, 2, 50)] * 3, indexing="ij"), axis=-1) @ turn
        out = np.abs(at) - [1, 0.8, 0.7]
        box = np.linalg.norm(np.maximum(out, 0), axis=-1) + np.minimum(out.max(axis=-1), 0)
        vertices, faces, _, _ = marching_cubes(np.maximum(box, 0.45 - np.hypot(at[..., 0], at[..., 1])), 0.0)
        network = sm.feature_lines((vertices * 4 / 49, faces))
        assert sum(line.closed for line in network.lines) >= 2
        lines.append(len(network.lines))
        lengths.append(sum(line.length for line in network.lines))
    assert np.median(lines) == 14
    assert max(lines) < 24
    assert lengths == pytest.approx([2 * np.pi * 0.45 * 2 + 8 * (1 + 0.8 + 0.7)] * 6, rel=0.1)


def test_teeth_one_quad_wide_have_their_edges():
    """A comb of even triangles without slivers, of which each tooth is as wide as they are."""
    teeth = [[2.0 * k + x, y] for k in range(6) for x, y in ((0, 0), (0, 1), (1, 1), (1, 0))]
    back = [[12.0, 0.0], [12, -1], *([x, -1] for x in range(11, 0, -1)), [0.0, -1]]
    outline = np.array(teeth + back, float)
    m, rows = len(outline), 12
    vertices = np.concatenate([np.column_stack([outline, np.full(m, float(z))]) for z in range(rows + 1)])
    corner = (np.arange(rows)[:, None] * m + np.arange(m)).ravel()
    beside = (np.arange(rows)[:, None] * m + (np.arange(m) + 1) % m).ravel()
    faces = np.concatenate([np.stack([corner, beside, beside + m], 1), np.stack([corner, beside + m, corner + m], 1)])
    network = sm.feature_lines((vertices, faces))
    assert sum(line.length for line in network.lines) == pytest.approx(26 * rows, rel=0.1)


@pytest.mark.parametrize(("back", "noise"), [(False, 0.0), (False, 0.05), (True, 0.0)])
def test_faces_one_quad_wide_have_both_edges(back, noise):
    """The riser of a step between two plates, and the rim of a wall, whose other side leads back."""
    flat = sheet(lambda x, y: 0 * x)
    x, y, _ = flat.vertices.T
    beyond = np.arange(len(y)) % 31 > 15  # behind the middle row
    y = np.where(beyond, np.maximum(y - 0.06, 0) * (-1 if back else 1), y)
    step = sm.TriangleMesh(np.column_stack([x, y, 0.06 * beyond]), flat.faces)
    network = sm.feature_lines(shaken(step, noise))
    assert [line.length for line in network.lines] == pytest.approx([2, 2], rel=0.02)
    assert np.degrees(np.concatenate([line.angle for line in network.lines])).mean() == pytest.approx(90, abs=4)


class TestGivenTriangles:
    def test_an_edge_of_three_is_refused_and_named(self):
        wing = np.concatenate([CUBE.faces, [[*CUBE.faces[0, :2], CUBE.n_vertices]]])
        with pytest.raises(sm.TopologyError) as caught:
            sm.feature_lines((np.concatenate([CUBE.vertices, [[3, 3, 3]]]), wing))
        named = CUBE.faces[0, :2].tolist()
        assert all(str(vertex) in str(caught.value) for vertex in named)

    def test_without_area_do_not_matter(self):
        faces, middle = CUBE.faces.tolist(), []
        for t in (5, 150, 400, 700):
            a, b, c = faces[t]
            middle.append((CUBE.vertices[a] + CUBE.vertices[b]) / 2)
            m = CUBE.n_vertices + len(middle) - 1
            faces[t] = [a, m, c]
            faces += [[m, b, c], [a, b, m]]
        network = sm.feature_lines((np.concatenate([CUBE.vertices, middle]), np.array(faces)))
        assert len(network.lines) == 12
        assert sum(line.length for line in network.lines) == pytest.approx(12, rel=1e-3)

    def test_may_come_with_vertices_of_their_own(self):
        soup = CUBE.vertices[CUBE.faces].reshape(-1, 3), np.arange(3 * CUBE.n_faces).reshape(-1, 3)
        network = sm.feature_lines(soup)
        assert len(network.lines) == 12
        assert network.mesh.n_vertices == CUBE.n_vertices


def test_arrays_of_a_network_are_read_only():
    network = sm.feature_lines(pv.Cube().triangulate().clean())
    assert len(network.node_vertices) == 8
    for array in (network.node_vertices, network.nodes, network.lines[0].points):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize(("degrees", "kept"), [(75, True), (105, False)])
def test_what_closes_a_gap_is_measured(degrees, kept):
    """It is as sharp as the rest of the line, and not flat, by which a quarter of the rim would take the rest away."""
    can = shaken(CAN, 0.02)
    mates = manifold.half_edge_mates(can.faces).ravel()
    facets, normals, exact = sampled(can.vertices, can.faces.astype(np.int64), mates)
    surface = creases.FilteredSurface(Edges(facets), normals, exact)
    rims = surface.bends > 1
    gap = rims & (can.vertices[surface.edges.ends, :2].mean(axis=1) > 0).all(axis=1)
    least = np.full(len(rims), np.radians(degrees))
    jumps = surface.jumps_at(rims & ~gap, rims)[0]
    found = creases._cleaned(surface, rims & ~gap, jumps, least, least)
    assert np.array_equal(found, rims if kept else np.zeros_like(rims))


def test_what_is_ordinary_is_more_where_triangles_are_smaller():
    """Noise turns them by more: a third of the size, three times as much; and half of the jumps are less."""
    noise, small = 0.1 * mean_edge(BALL), BALL.vertices / 3 + [3, 0, 0]
    both = sm.TriangleMesh(
        np.concatenate([BALL.vertices, small]), np.concatenate([BALL.faces, BALL.faces + len(small)])
    )
    both = both.vertices + noise * np.random.default_rng(0).normal(size=both.vertices.shape), both.faces
    facets, normals, exact = sampled(*both, manifold.half_edge_mates(both[1]).ravel())
    surface = creases.FilteredSurface(Edges(facets), normals, exact)
    ordinary, there = creases._ordinary_jumps(surface), facets.vertices[surface.edges.ends[:, 0], 0] > 1.5
    assert np.median(ordinary[there]) == pytest.approx(3 * np.median(ordinary[~there]), rel=0.1)
    some = np.arange(len(there)) % 20 == 0
    jumps = np.abs(surface.jumps_at(some, np.zeros(len(there), bool))[0])
    assert np.mean(jumps[some] < ordinary[some]) == pytest.approx(0.5, abs=0.1)


def test_few_triangles_without_exact_normals_are_not_ordinary():
    """Those beside the rims alone, say: five times their jump is more than any crease has."""
    facets, normals, exact = sampled(
        CAN.vertices, CAN.faces.astype(np.int64), manifold.half_edge_mates(CAN.faces).ravel()
    )
    rims = (np.abs(CAN.vertices[CAN.faces, 2]) > 0.99).any(axis=1)
    surface = creases.FilteredSurface(Edges(facets), normals, np.ones_like(exact) & ~rims)
    assert creases._ordinary_jumps(surface).max() == 0
    assert creases._ordinary_jumps(creases.FilteredSurface(Edges(facets), normals, np.zeros_like(exact))).min() > 0


@pytest.mark.parametrize(
    ("first", "last", "lost"), [(15, 20, (15, 20)), (3, 6, (0, 6)), (30, 31, (30, 31)), (36, 38, (36, 40))]
)
def test_a_line_with_one_weak_part_loses_that_part(first, last, lost):
    """And what is left of it beside that, if it is shorter than a line may be; the strong rest stays as it is."""
    body = sheet(lambda x, y: 0 * x)
    edges = Edges(measured(body.vertices, body.faces, manifold.half_edge_mates(body.faces).ravel()))
    facets = edges.facets
    line = (facets.vertices[edges.ends][:, :, 1] == 0).all(axis=1)
    order = np.flatnonzero(line)[np.argsort(facets.vertices[edges.ends[line], 0].mean(axis=1))]
    excess, left = np.where(line, 1.0, 0.0), line.copy()
    excess[order[first:last]] = -100
    left[order[slice(*lost)]] = False
    shortest = np.full(len(line), 5 * edges.lengths[line].mean())
    assert np.array_equal(creases._without_weak_parts(edges, line, excess, shortest), left)
