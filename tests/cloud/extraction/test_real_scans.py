"""Extraction from parts with exact primitives (Fit4CAD, Romanengo et al. 2021) and from a depth camera."""

from __future__ import annotations

import re

import numpy as np
import pytest

import simplexmesh as sm


def part(folder, name):
    """The points of a part, the number of the segment of each, and the kinds of segments."""
    points, members, told = (
        (folder / f"fit4cad_{name}{end}.txt").read_text() for end in ("", "_primitives", "_parametric")
    )
    found = re.findall(r"\[\s*([-\d.eE+]+),\s*([-\d.eE+]+),\s*([-\d.eE+]+)\]", points)
    labels = np.full(len(found), -1)
    for number, rows in enumerate(re.findall(r"Primitive\d+:=\[([\d\s]+)\]", members)):
        labels[np.array(rows.split(), int) - 1] = number
    return np.array(found, float), labels, [kind.lower() for kind in re.findall(r"Primitive\d+:=\[(\w+),", told)]


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "found"), [("PC42", 2), pytest.param("PC18", 13, marks=pytest.mark.nightly), ("PC49", 6)]
)
def test_segments_of_parts_are_found_and_no_others(data_folder, name, found):
    points, labels, kinds = part(data_folder, name)
    scene = sm.extract_primitives(points)
    hits = 0
    for number, kind in enumerate(kinds):
        mine = labels == number
        for k, each in enumerate(scene.primitives):
            common, either = (mine & (scene.labels == k)).sum(), (mine | (scene.labels == k)).sum()
            hits += each.kind == kind and common > either / 2
    assert hits >= found
    assert len(scene) <= hits + 1


@pytest.mark.data
@pytest.mark.nightly
def test_the_floor_under_a_box_is_flat(data_folder):
    points = sm.read_points(data_folder / "box_rgbd.ply").points
    floor, side = sm.extract_primitives(points).primitives[:2]
    assert floor.kind == side.kind == "plane"
    assert floor.fit.count + side.fit.count > 0.8 * len(points)
