"""From scan to guide, as the thesis plans operations on jaws (Charton 2014, 5.1.2): cut, moved, occluded, guided."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import simplexmesh as sm


def teeth(*, upper):
    """A row of teeth on a gum, closed; the upper row occludes with the lower without a gap."""
    flat = sm.plane(60, 30, size=(4.0, 2.0)).triangulated("dual")
    x, y, _ = flat.vertices.T
    z = 0.25 * np.cos(3.1 * x + 0.3 * y) * np.exp(-((y / 0.7) ** 2)) + 0.12 * np.sin(5 * y) + 0.05 * x * y
    top = np.stack([x, y, z], axis=1)
    depth = 1.5 if upper else -1.5
    n = len(top)
    base = np.stack([x, y, np.full(n, depth)], axis=1)
    ends = flat.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    both = {tuple(pair) for pair in ends.tolist()}
    rim = [(a, b) for a, b in ends.tolist() if (b, a) not in both]
    sides = [[b, a, a + n] for a, b in rim] + [[b, a + n, b + n] for a, b in rim]
    faces = np.concatenate([flat.faces, flat.faces[:, ::-1] + n, sides])
    return sm.TriangleMesh(np.concatenate([top, base]), faces[:, ::-1] if upper else faces)


def box(low, high):
    """A closed box."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6]]
    faces += [[0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return sm.TriangleMesh(np.array(low) + corners * (np.array(high) - low), faces)


def moved(degrees, shift):
    """A small motion."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(np.radians(degrees)).as_matrix()
    T[:3, 3] = shift
    return T


@pytest.fixture(scope="module")
def plan():
    """The results of all steps, in order."""
    upper, lower = teeth(upper=True), teeth(upper=False)
    ramus = sm.clipped(lower, (1.2, 0, 0), (1, 0, 0), cap=True)  # what stays with the joint
    body = sm.clipped(lower, (1.2, 0, 0), (-1, 0, 0), cap=True)
    retruded = body.transformed(moved([1.5, -2.0, 1.0], [0.12, -0.03, -0.2]))  # where the patient has it
    found = sm.occlude(retruded, upper)
    placed = retruded.transformed(found.T_target_source)
    block = box([-1.8, -0.9, -0.6], [1.0, 0.9, 0.6])
    guide = sm.boolean(block, placed)
    return {"lower": lower, "ramus": ramus, "body": body, "found": found, "placed": placed, "guide": guide}


def test_cutting_loses_nothing(plan):
    assert plan["ramus"].is_closed
    assert plan["body"].is_closed
    assert plan["ramus"].volume + plan["body"].volume == pytest.approx(plan["lower"].volume, rel=1e-9)
    assert (plan["ramus"].bounds[0, 0], plan["body"].bounds[1, 0]) == (pytest.approx(1.2), pytest.approx(1.2))


def test_the_body_of_the_jaw_goes_back_into_occlusion(plan):
    assert plan["placed"].vertices == pytest.approx(plan["body"].vertices, abs=1e-6)
    assert plan["found"].contact_area > 10 * max(plan["found"].area_before, 0.01)
    assert plan["found"].penetration < 1e-4
    assert sm.deviation(plan["placed"], plan["body"]).max < 1e-6


def test_the_guide_is_watertight_and_its_negative_fits(plan):
    guide, placed = plan["guide"], plan["placed"]
    assert guide.is_closed
    assert guide.n_components == 1
    assert guide.volume > 0.2
    inner = guide.vertices[(np.abs(guide.vertices - [-0.4, 0, 0]) < [1.35, 0.85, 0.55]).all(axis=1)]
    assert len(inner) > 300
    assert sm.deviation(inner, placed).max < 1e-9
    with pytest.raises(ValueError, match="must have a non-empty intersection, but nothing is left"):
        sm.boolean(guide, sm.TriangleMesh(placed.vertices - [0, 0, 1e-6], placed.faces), "intersection")


@pytest.mark.nightly
def test_the_guide_leads_back_to_where_it_was_made(plan):
    """A device that keeps a bone's place: put on the bone anywhere near, it finds the place it was cut for."""
    guide = plan["guide"]
    found = sm.occlude(guide.transformed(moved([2.0, 1.0, -2.0], [0.06, -0.05, 0.15])), plan["placed"])
    off = (
        guide.transformed(found.T_target_source @ moved([2.0, 1.0, -2.0], [0.06, -0.05, 0.15])).vertices
        - guide.vertices
    )
    assert np.linalg.norm(off, axis=1).max() < 1e-3
    assert found.penetration < 1e-4


@pytest.mark.parametrize(("operation", "volume"), [("union", 1.876), ("difference", 1.874), ("intersection", 0.001)])
def test_what_is_within_two_bodies_of_one_surface_counts_once(operation, volume):
    """Two cubes that share an eighth of each, and a small one in or beside them."""
    cube = box([0, 0, 0], [1, 1, 1])
    both = sm.TriangleMesh(
        np.concatenate([cube.vertices, cube.vertices + 0.5]), np.concatenate([cube.faces, cube.faces + 8])
    )
    other = box([0.7] * 3, [0.8] * 3) if operation != "union" else box([2.0] * 3, [2.1] * 3)
    found = sm.boolean(both, other, operation)
    assert found.volume == pytest.approx(volume, rel=1e-9)
    assert sm.boolean(other, both, "union").volume == pytest.approx(1.876 if operation == "union" else 1.875, rel=1e-9)


@pytest.mark.parametrize("size", [0.5, 0.9])
def test_a_body_inside_out_beside_others_is_refused(size):
    """Its volume was taken away from theirs: one of 1 and one of 0.125 were 0.875."""
    cube, other = box([0, 0, 0], [1, 1, 1]), box([0.6] * 3, [0.6 + size] * 3)
    both = sm.TriangleMesh(
        np.concatenate([cube.vertices, other.vertices]), np.concatenate([cube.faces, other.faces[:, ::-1] + 8])
    )
    with pytest.raises(ValueError, match=r"^second must be oriented outward, its part around \([\d., ]+\) is inward"):
        sm.boolean(box([2.0] * 3, [3.0] * 3), both, "union")


def test_that_a_cap_has_gaps_is_told():
    cube = box([0, 0, 0], [1, 1, 1])
    both = sm.TriangleMesh(
        np.concatenate([cube.vertices, np.add(cube.vertices, [3, 0, 0])]),
        np.concatenate([cube.faces, cube.faces[:, ::-1] + 8]),
    )
    with pytest.warns(sm.SimplexMeshWarning, match="^the cap has gaps, so the part is open"):
        found = sm.clipped(both, (0, 0, 0.3), (0, 1, 1), cap=True)
    assert not found.is_closed


@pytest.mark.data
@pytest.mark.parametrize("outward", [True, False])
def test_caps_that_vtk_leaves_open_are_closed(data_folder, outward):
    part = sm.read_triangles(data_folder / "coupling.off").welded(report=False)
    part = sm.TriangleMesh(
        part.vertices, part.faces if outward else part.faces[:, ::-1], {"place": part.vertices}, "mm"
    )
    halves = [sm.clipped(part, (0, 0, 0), (side, 0, 0), cap=True) for side in (1, -1)]
    assert [half.is_closed for half in halves] == [True, True]
    assert sum(half.volume for half in halves) == pytest.approx(part.volume, rel=1e-9)
    assert [half.unit for half in halves] == ["mm", "mm"]
    assert [half.data["place"] == pytest.approx(half.vertices, abs=1e-9) for half in halves] == [True, True]


def test_cavities_of_bodies_stay():
    hollow, core = box([0, 0, 0], [1, 1, 1]), box([0.25] * 3, [0.75] * 3)
    shell = sm.TriangleMesh(
        np.concatenate([hollow.vertices, core.vertices]), np.concatenate([hollow.faces, core.faces[:, ::-1] + 8])
    )
    assert sm.boolean(shell, box([2.0] * 3, [3.0] * 3), "union").volume == pytest.approx(1.875, rel=1e-9)
