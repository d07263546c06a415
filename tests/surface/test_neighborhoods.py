"""Neighborhoods on meshes that are open, pinched or branched, in clouds, and around some vertices."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import simplexmesh as sm
from simplexmesh.surface import sampled_surface as door
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.sampled_surface import SampledSurface, as_sampled_surface, wedges_between

# --- naive twins -------------------------------------------------------------------------------------------------


def edges(faces, n):
    """The vertices one edge away from each."""
    near = [set() for _ in range(n)]
    for face in faces.tolist():
        for a in face:
            near[a] |= set(face) - {a}
    return near


def breadth_first(near, center, count):
    """Every vertex within a number of edges, ring by ring."""
    seen, front = {center}, {center}
    for _ in range(count):
        front = set().union(*(near[i] for i in front)) - seen if front else set()
        seen |= front
    return seen - {center}


def inside(near, points, center, radius):
    """Every vertex of the ball that a path inside it leads to."""
    seen, front = {center}, [center]
    while front:
        for j in near[front.pop()] - seen:
            if np.linalg.norm(points[j] - points[center]) <= radius:
                seen.add(j)
                front.append(j)
    return seen - {center}


def fans(faces, center):
    """The wedges around a vertex: where each leads from and to."""
    out = []
    for face in faces.tolist():
        if center in face:
            j = face.index(center)
            out.append((face[(j + 1) % 3], face[(j + 2) % 3]))
    return out


def cycle(faces, center):
    """The ring of an inner vertex by its definition: start at the smallest, go on to where the next triangle leads."""
    leads = dict(fans(faces, center))
    ring = [min(leads)]
    while len(ring) < len(leads):
        ring.append(leads[ring[-1]])
    return ring


# --- families of meshes ------------------------------------------------------------------------------------------


def strip(rows=5, columns=6):
    """An open rectangle, bent so that distances differ."""
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    points = np.stack([x, y, 0.1 * np.sin(x + 2 * y)], axis=-1).reshape(-1, 3).astype(float)
    i = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    return points, np.concatenate(
        [np.stack([i, i + 1, i + columns + 1], 1), np.stack([i, i + columns + 1, i + columns], 1)]
    )


def two_tetrahedra():
    """Two closed bodies that share the vertex 0."""
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], float)
    return points, np.concatenate([faces, np.where(faces > 0, faces + 3, 0)[:, ::-1]])


def five_tetrahedra():
    """Five closed bodies that share the vertex 0, with smaller numbers the later they come."""
    points, faces = [[0, 0, 0]], []
    for body in range(5):
        first = 1 + 3 * (4 - body)
        faces += [
            [0, first + 1, first],
            [0, first, first + 2],
            [first, first + 1, first + 2],
            [first + 1, 0, first + 2],
        ]
        points += (np.eye(3) + body).tolist()
    return np.array(points, float), np.array(faces)


def book():
    """Three triangles at the edge (0, 1): not a surface there."""
    return np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, -1, 0]], float), np.array(
        [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
    )


def closed_book():
    """The closed ring around vertex 0 and one triangle more at its edge (0, 1)."""
    points, faces = (
        np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, -1, 0], [2, 0, 2]], float),
        [
            [0, 1, 2],
            [0, 2, 3],
            [0, 3, 1],
            [0, 1, 4],
        ],
    )
    return points, np.array(faces)


def two_flaps():
    """Two triangles seen from both sides that share the edge (0, 1): around 0 one can walk twice without a stop."""
    points = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [5, 5, 5]], float)
    return points, np.array([[0, 1, 2], [0, 2, 1], [0, 1, 3], [0, 3, 1]])


def with_isolated():
    points, faces = strip()
    return np.concatenate([points, [[2.5, 2.5, 0.2]]]), faces


FAMILIES = {
    "sphere": lambda: door_parts(sm.sphere(4)),
    "torus": lambda: door_parts(sm.torus(8, 6)),
    "strip": strip,
    "two tetrahedra": two_tetrahedra,
    "five tetrahedra": five_tetrahedra,
    "book": book,
    "closed book": closed_book,
    "two flaps": two_flaps,
    "isolated": with_isolated,
}


def door_parts(mesh):
    triangles = mesh.triangulated("dual")
    return triangles.vertices, triangles.faces


@pytest.fixture(params=FAMILIES)
def surface(request):
    points, faces = FAMILIES[request.param]()
    return SampledSurface(np.asarray(points), np.asarray(faces, np.int64))


def sets(around):
    return [set(around[row].tolist()) for row in range(len(around))]


# --- rings -------------------------------------------------------------------------------------------------------


class TestOneRing:
    def test_holds_the_vertices_one_edge_away_once_each(self, surface):
        ring = surface.one_ring
        assert sets(ring) == edges(surface.faces, len(surface.points))
        assert [len(s) for s in sets(ring)] == ring.valence.tolist()

    def test_is_closed_where_the_triangles_go_around_once(self, surface):
        for i, closed in enumerate(surface.one_ring.closed):
            wedges = fans(surface.faces, i)
            ahead, behind = [a for a, _ in wedges], [b for _, b in wedges]
            once = len(set(ahead)) == len(ahead) and sorted(ahead) == sorted(behind)
            assert closed == bool(once and wedges and len(cycle_of(wedges)) == len(wedges))
            if closed:
                assert surface.one_ring[i].tolist() == cycle(surface.faces, i)

    def test_of_a_border_vertex_goes_from_its_first_edge_to_its_last(self):
        points, faces = strip()
        ring = SampledSurface(points, faces).one_ring
        for i in range(len(points)):
            if not ring.closed[i]:
                pairs = list(zip(ring[i][:-1].tolist(), ring[i][1:].tolist(), strict=True))
                assert sorted(pairs) == sorted(fans(faces, i))

    def test_runs_counter_clockwise_seen_from_outside(self):
        points, faces = door_parts(sm.sphere(4))
        ring = SampledSurface(points, faces).one_ring
        for i in range(len(points)):
            to = points[ring[i]] - points[i]
            assert (np.cross(to, np.roll(to, -1, axis=0)) @ points[i] > 0).all()

    def test_does_not_depend_on_the_order_of_faces(self):
        points, faces = door_parts(sm.torus(8, 6))
        mixed = np.random.default_rng(0).permutation(faces)
        one, other = SampledSurface(points, faces).one_ring, SampledSurface(points, mixed).one_ring
        np.testing.assert_array_equal(one.members, other.members)

    @pytest.mark.parametrize("border", [False, True])
    def test_of_a_large_fan_is_its_rim(self, border):
        """In any order of its triangles, around a hub that is not the first point."""
        rim = np.arange(5000)
        faces = np.stack([np.full(5000, 5000), rim, np.roll(rim, -1)], axis=1)[: 5000 - border]
        angles = 2 * np.pi * rim / 5000
        points = np.concatenate([np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1), np.zeros((1, 3))])
        mixed = np.random.default_rng(0).permutation(faces)
        ring = SampledSurface(points, mixed).one_ring
        assert ring[5000].tolist() == rim.tolist()
        assert ring.closed[5000] != border

    def test_of_a_regular_torus_has_six_vertices(self):
        around = as_sampled_surface(sm.torus(8, 6).triangulated("dual")).one_ring
        assert (around.valence == 6).all()
        assert around.closed.all()


def cycle_of(wedges):
    """The wedges met when going around from the first one."""
    leads, first = dict(wedges), wedges[0][0]
    met, at = [], first
    while at in leads and at not in met:
        met.append(at)
        at = leads[at]
    return met


class TestWedges:
    def test_are_the_triangles(self, surface):
        offsets, ahead, behind = surface.wedges
        for i in range(len(surface.points)):
            mine = slice(offsets[i], offsets[i + 1])
            assert list(zip(ahead[mine].tolist(), behind[mine].tolist(), strict=True)) == fans(surface.faces, i)

    def test_between_ordered_neighbors_are_the_same_on_a_surface(self):
        points, faces = strip()
        samples = SampledSurface(points, faces)
        offsets, ahead, behind = wedges_between(samples.one_ring)
        for i in range(len(points)):
            mine = slice(offsets[i], offsets[i + 1])
            between = list(zip(ahead[mine].tolist(), behind[mine].tolist(), strict=True))
            assert sorted(between) == sorted(fans(faces, i))

    def test_of_a_point_without_neighbors_are_none(self):
        ring = Neighborhoods.of([[1, 2], [-1, -1], [0, -1]], closed=True)
        offsets, ahead, behind = wedges_between(ring)
        assert offsets.tolist() == [0, 2, 2, 3]
        assert (ahead.tolist(), behind.tolist()) == ([1, 2, 0], [2, 1, 0])


class TestRings:
    @pytest.mark.parametrize("count", [1, 2, 3, 7])
    def test_equal_a_breadth_first_search(self, surface, count):
        near = edges(surface.faces, len(surface.points))
        found = surface.around(sm.rings(count))
        assert sets(found) == [breadth_first(near, i, count) for i in range(len(near))]
        assert [len(s) for s in sets(found)] == found.valence.tolist()

    def test_come_nearest_first(self):
        points, faces = strip()
        samples = SampledSurface(points, faces)
        near = edges(faces, len(points))
        wide = samples.around(sm.rings(3))
        for i in range(len(points)):
            far = [next(k for k in (1, 2, 3) if j in breadth_first(near, i, k)) for j in wide[i].tolist()]
            assert far == sorted(far)

    def test_on_a_regular_mesh_have_six_times_the_triangular_numbers(self):
        samples = as_sampled_surface(sm.torus(30, 20).triangulated("dual"))
        for count in (1, 2, 3, 4):
            assert (samples.around(sm.rings(count)).valence == 3 * count * (count + 1)).all()

    @pytest.mark.parametrize("count", [1, 2])
    def test_of_some_vertices_are_rows_of_all(self, surface, count):
        asked = [3, 1, 1, 4]
        all_, some = surface.around(sm.rings(count)), surface.around(sm.rings(count), asked)
        assert some.centers.tolist() == asked
        for row, i in enumerate(asked):
            assert some[row].tolist() == all_[i].tolist()
            assert some.closed[row] == all_.closed[i]


# --- balls -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("radius", [0.2, 1.0, 1.5, 100.0])
class TestBalls:
    def test_connected_are_what_paths_inside_reach(self, surface, radius):
        near = edges(surface.faces, len(surface.points))
        found = surface.around(sm.ball(radius))
        assert sets(found) == [inside(near, surface.points, i, radius) for i in range(len(near))]

    def test_others_are_all_points_near_enough(self, surface, radius):
        points = surface.points
        far = np.linalg.norm(points[:, None] - points, axis=-1)
        np.fill_diagonal(far, np.inf)
        found = surface.around(sm.ball(radius, connected=False))
        assert [row.tolist() for row in map(found.__getitem__, range(len(found)))] == [
            np.flatnonzero(row <= radius).tolist() for row in far
        ]

    @pytest.mark.parametrize("connected", [False, True])
    def test_shells_are_balls_less_the_smaller_ball(self, surface, radius, connected):
        inner = 0.75 * radius
        whole = surface.around(sm.ball(radius, connected=connected))
        shell = surface.around(sm.ball(radius, inner=inner, connected=connected))
        for i in range(len(surface.points)):
            far = np.linalg.norm(surface.points[whole[i]] - surface.points[i], axis=1) >= inner
            assert shell[i].tolist() == whole[i][far].tolist()

    def test_of_some_vertices_are_rows_of_all(self, surface, radius):
        for connected in (False, True):
            asked = [2, 0, 2]
            all_ = surface.around(sm.ball(radius, connected=connected))
            some = surface.around(sm.ball(radius, connected=connected), asked)
            assert [some[row].tolist() for row in range(3)] == [all_[i].tolist() for i in asked]


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(4, 80), radius=st.floats(1e-3, 3), stretch=st.floats(1e-4, 1e7))
def test_balls_of_any_cloud_are_all_points_near_enough(seed, n, radius, stretch):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, 3)) * [1, 1, stretch]
    points[: n // 4] = points[-(n // 4) or n :][: n // 4]  # copies
    found = SampledSurface(points).around(sm.ball(radius))
    square = sum((points[:, None, axis] - points[None, :, axis]) ** 2 for axis in range(3))
    np.fill_diagonal(square, np.inf)
    np.testing.assert_array_equal(found.members, np.nonzero(square <= radius * radius)[1])
    np.testing.assert_array_equal(found.valence, (square <= radius * radius).sum(axis=1))


def test_a_shell_of_some_points_around_the_radius():
    """Within a tenth of the distance of the second neighbors along both axes of a square grid."""
    x, y = np.meshgrid(np.arange(7.0), np.arange(7.0))
    grid = SampledSurface(np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3))
    shell = grid.around(sm.ball(2.2, inner=1.8), [24, 0])
    assert [row.tolist() for row in (shell[0], shell[1])] == [[10, 22, 26, 38], [2, 14]]
    assert sm.ball(2.0, inner=2) == sm.ball(2.0, inner=2.0) != sm.ball(2.0)
    for inner in (-1.0, 2.1):
        with pytest.raises(ValueError, match=rf"^inner must be between 0 and 2, not {inner:g}$"):
            sm.ball(2.0, inner=inner)


def test_the_other_side_of_a_thin_wall_is_excluded():
    points, faces = strip()
    points[:, 2] = 0
    lower = points - [0, 0, 0.1]
    wall = SampledSurface(np.concatenate([points, lower]), np.concatenate([faces, faces[:, ::-1] + len(points)]))
    for i, row in enumerate(sets(wall.around(sm.ball(1.2)))):
        assert {j < len(points) for j in row} == {i < len(points)}
    assert {j < len(points) for j in sets(wall.around(sm.ball(1.2, connected=False)))[0]} == {True, False}


# --- nearest -----------------------------------------------------------------------------------------------------


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(4, 60), count=st.integers(1, 70))
def test_nearest_points_are_no_farther_than_any_other(seed, n, count):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, 3))
    found = SampledSurface(points).around(sm.nearest(count))
    far = np.linalg.norm(points[:, None] - points, axis=-1)
    assert (found.valence == min(count, n - 1)).all()
    for i, row in enumerate(sets(found)):
        others = sorted(set(range(n)) - {i}, key=lambda j, i=i: far[i, j])[: len(row)]
        assert row == set(others)


def test_copies_of_a_point_are_neighbors_and_the_point_itself_never_is():
    points = np.concatenate([np.zeros((9, 3)), np.random.default_rng(0).normal(size=(9, 3)) + 5])
    found = SampledSurface(points).around(sm.nearest(4))
    for i in range(18):
        assert i not in found[i]
        assert len(set(found[i].tolist())) == 4
    assert all((points[found[i]] == 0).all() for i in range(9))


def test_the_one_ring_of_a_cloud_is_its_nearest_points():
    cloud = sm.PointCloud(np.random.default_rng(0).normal(size=(40, 3)))
    samples = as_sampled_surface(cloud)
    assert (samples.around(sm.rings(1)).valence == door.CLOUD_NEIGHBORS).all()
    assert (as_sampled_surface(np.eye(4)[:, :3]).one_ring.valence == 3).all()
    assert not samples.one_ring.closed.any()


# --- simplex meshes ----------------------------------------------------------------------------------------------


class TestSimplexMeshes:
    def test_links_run_counter_clockwise_seen_from_outside(self):
        mesh = sm.sphere(5)
        ring = as_sampled_surface(mesh).one_ring
        for i in range(mesh.n_vertices):
            a, b, c = mesh.vertices[ring[i]] - mesh.vertices[i]
            assert min(np.cross(a, b) @ mesh.normals[i], np.cross(b, c) @ mesh.normals[i]) > 0
        assert ring.closed.all()

    def test_a_hole_opens_the_links_around_it(self):
        mesh = sm.plane(6, 6)
        ring = as_sampled_surface(mesh).one_ring
        c = mesh.connectivity
        rim = set(np.flatnonzero(c.face_is_hole[c.face].any(axis=1)).tolist())
        assert set(np.flatnonzero(~ring.closed).tolist()) == rim
        assert 0 < len(rim) < mesh.n_vertices
        for i in rim:
            hole = next(
                set(c.face_vertices[c.face_offsets[f] : c.face_offsets[f + 1]].tolist())
                for f in c.face[i]
                if c.face_is_hole[f]
            )
            assert {ring[i][0], ring[i][-1]} <= hole  # the gap lies between the last and the first

    def test_own_normals_are_kept(self):
        mesh = sm.plane(6, 6)
        assert (as_sampled_surface(mesh).outward == mesh.normals).all()
        cloud = sm.PointCloud(mesh.vertices, mesh.normals)
        assert (as_sampled_surface(cloud).outward == cloud.normals).all()
        assert as_sampled_surface(mesh.triangulated()).outward is None

    def test_neighbors_stay_those_of_the_mesh(self):
        mesh = sm.plane(6, 6)
        ring = as_sampled_surface(mesh).one_ring
        assert [set(row) for row in mesh.neighbors.tolist()] == sets(ring)


# --- what callers give -------------------------------------------------------------------------------------------


class TestGiven:
    def test_neighborhoods_are_used_unchanged(self):
        samples = SampledSurface(np.eye(4)[:, :3])
        made = Neighborhoods.of([[1, 2], [0, -1], [3, 0], [-1, -1]])
        assert samples.around(made) is made
        some = samples.around(made, [2, 0])
        assert [row.tolist() for row in (some[0], some[1])] == [[3, 0], [1, 2]]

    @pytest.mark.parametrize(
        ("make", "message"),
        [
            (lambda: Neighborhoods([0], [0, 1], [9], [False]), "neighborhood must name points below 4, not 9"),
            (lambda: Neighborhoods([7], [0, 1], [1], [False]), "neighborhood must name points below 4, not 7"),
        ],
    )
    def test_other_points_are_refused(self, make, message):
        with pytest.raises(ValueError, match=f"^{message}$"):
            SampledSurface(np.eye(4)[:, :3]).around(make())

    @pytest.mark.parametrize(
        ("parts", "message"),
        [
            (([0], [0, 1], [-1], [False]), "members must be point indices, not -1"),
            (([-2], [0, 1], [1], [False]), "centers must be point indices, not -2"),
            (([0], [0, 2], [1], [False]), "offsets must rise from 0 to the number of members, 1"),
            (([0], [0], [], [False]), "offsets and closed must have 2 and 1 entries for 1 centers"),
        ],
    )
    def test_broken_neighborhoods_are_refused(self, parts, message):
        with pytest.raises(ValueError, match=f"^{message}$"):
            Neighborhoods(*map(np.array, parts))

    @pytest.mark.parametrize(
        ("parts", "error", "message"),
        [
            (([0.5], [0, 1], [1], [False]), TypeError, "centers must be whole numbers, not float64"),
            (([0], [0, 1], [1.5], [False]), TypeError, "members must be whole numbers, not float64"),
            (([0], [0, 1.0], [1], [False]), TypeError, "offsets must be whole numbers, not float64"),
            ((3, [0], [], []), ValueError, r"centers must have shape \(\*,\), not \(\)"),
            (([0], [0, 1], [[1]], [False]), ValueError, r"members must have shape \(\*,\), not \(1, 1\)"),
            (([0], [0, 1], [1], [2]), TypeError, "closed must be bool, not int64"),
            ((["a"], [0, 1], [1], [True]), TypeError, r"centers must be numbers of shape \(\*,\), not ndarray of <U1"),
        ],
    )
    def test_other_than_indices_are_refused(self, parts, error, message):
        with pytest.raises(error, match=f"^{message}$"):
            Neighborhoods(*parts)

    def test_nothing_around_nothing(self):
        assert len(Neighborhoods([], [0], [], [])) == 0

    def test_a_point_is_not_its_own_neighbor(self):
        made = Neighborhoods([1, 2], [0, 1, 3], [0, 1, 2], [False, False])
        with pytest.raises(ValueError, match=r"^neighborhood must not have a point among its own neighbors, as 2 has$"):
            SampledSurface(np.eye(4)[:, :3]).around(made)

    def test_connected_is_true_or_false(self):
        with pytest.raises(TypeError, match=r"^connected must be true or false, not str 'no'$"):
            sm.ball(1.0, connected="no")

    def test_rows_of_an_array_leave_out_negative_entries_and_the_point_itself(self):
        made = Neighborhoods.of([[1, -1, 2], [1, 0, -1], [-1, -1, -1]])
        assert [made[i].tolist() for i in range(3)] == [[1, 2], [0], []]
        assert (made.valence.tolist(), made.closed.tolist()) == ([2, 1, 0], [False] * 3)
        assert [row.tolist() for row in map(made.taken([True, False, True]).__getitem__, range(2))] == [[1, 2], []]
        with pytest.raises(ValueError, match=r"^neighborhood must name points below 2, not 2$"):
            Neighborhoods.of([[1, 2], [0, 1]])
        with pytest.raises(TypeError, match=r"^neighborhood must be a \(n, k\) array of point indices, not float64"):
            Neighborhoods.of([[0.5]])
        with pytest.raises(ValueError, match=r"^at\[0\] is 3, outside 0..2$"):
            made.taken([3])

    def test_vertices_without_neighborhoods_are_refused(self):
        made = Neighborhoods(np.array([1]), np.array([0, 1]), np.array([2]), np.array([False]))
        with pytest.raises(ValueError, match=r"^at must select vertices with neighborhoods; vertex 3 has none$"):
            SampledSurface(np.eye(4)[:, :3]).around(made, [1, 3])

    def test_a_number_is_no_neighborhood(self):
        with pytest.raises(TypeError, match=r"^neighborhood must come from rings, ball or nearest, or be .*, not int$"):
            SampledSurface(np.eye(4)[:, :3]).around(2)

    @pytest.mark.parametrize(
        "asked", [sm.rings(1), sm.rings(2), sm.ball(1), sm.ball(1, connected=False), sm.nearest(3)]
    )
    def test_no_vertices_have_no_neighborhoods(self, asked):
        points, faces = strip()
        assert len(SampledSurface(points, faces).around(asked, [])) == 0

    @pytest.mark.parametrize("asked", [sm.rings(9), sm.ball(9), sm.ball(9, connected=False)])
    def test_too_many_members_are_refused(self, asked, monkeypatch):
        monkeypatch.setattr(door, "MAX_MEMBERS", 100)
        points, faces = strip()
        with pytest.raises(ValueError, match=r"^neighborhood must hold at most 100 neighbors in all, not those of \w+"):
            SampledSurface(points, faces).around(asked)

    @pytest.mark.parametrize("make", [sm.rings, sm.nearest, sm.ball])
    def test_zero_is_refused(self, make):
        with pytest.raises(ValueError, match="must be"):
            make(0)


def test_every_given_point_has_its_row():
    import pyvista
    import trimesh

    points, faces = strip()
    points, faces = np.concatenate([points, points[:1]]), np.concatenate([faces, [[len(points), 1, 7]]])
    with_edges = pyvista.PolyData.from_regular_faces(points, faces)
    for given_ in ((points, faces), with_edges, trimesh.Trimesh(points, faces, process=False), points, points.tolist()):
        assert len(as_sampled_surface(given_).points) == len(points)


def test_rings_of_a_mesh_with_shuffled_vertices_are_the_shuffled_rings():
    points, faces = door_parts(sm.sphere(4))
    order = np.random.default_rng(1).permutation(len(points))
    place = np.argsort(order)
    one, other = SampledSurface(points, faces).one_ring, SampledSurface(points[order], place[faces]).one_ring
    relabeled = defaultdict(set)
    for row in range(len(other)):
        relabeled[int(order[row])] = set(order[other[row]].tolist())
    assert [relabeled[i] for i in range(len(points))] == sets(one)
