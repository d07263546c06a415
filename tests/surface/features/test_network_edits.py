"""Edits of networks of lines, and their files."""

from __future__ import annotations

import json

import numpy as np
import pytest
import pyvista as pv
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from tests.surface.features.sheets import folded

CUBE = sm.divided(pv.Cube().triangulate().clean(), 0.15)
CAN = sm.divided(pv.Cylinder(resolution=48, radius=1, height=2).triangulate().clean(), 0.2)
FADING = folded(lambda x: np.clip(40 - 80 / 3 * x, 0, None))
BROKEN = folded(lambda x: 3 + 37 * np.abs(x / 1.5 - 1), 3.0)
"""Folds of 40 degrees that fade to 0 where x is 1.5, and to 3 degrees in the middle."""


class TestEdits:
    def test_without(self):
        network = sm.feature_lines(CUBE)
        fewer = network.without(0)
        assert len(network) == 12
        assert len(fewer) == 9
        assert sum(line.length for line in fewer.lines) == pytest.approx(11)
        assert len(network.without(*range(12))) == 0

    @pytest.mark.parametrize("numbers", [[0, 5], (0, 5), np.array([0, 5]), range(0, 6, 5)])
    def test_of_several_lines(self, numbers):
        network = sm.feature_lines(CUBE)
        left = network.without(numbers)
        assert [line.length for line in left.lines] == [line.length for line in network.without(0, 5).lines]
        assert len(network.without([])) == len(network)
        for wrong in ([0, 5.0], [[0, 5]], "05", None):
            with pytest.raises(TypeError, match="line must be a whole number"):
                network.without(wrong)

    def test_prolonged_needs_a_free_end(self):
        for body in (CAN, CUBE):
            with pytest.raises(ValueError, match="a line to prolong must have a free end"):
                sm.feature_lines(body).prolonged(0, angle=0.1)

    def test_prolonged(self):
        network = sm.feature_lines(FADING, angle=np.radians(25))  # where x is 0.56
        reach = [network.prolonged(0, angle=np.radians(angle)).lines[0].points for angle in (35, 18, 12)]
        assert len(reach[0]) == len(network.lines[0].points)
        assert network.lines[0].length < reach[1][:, 0].max() < reach[2][:, 0].max() < 1.25
        assert reach[2][:, 0].max() > 0.85
        assert_allclose(reach[2][:, 1], 0, atol=2e-3)

    def test_joined(self):
        network = sm.feature_lines(BROKEN)
        assert len(network) == 2
        (line,) = network.joined(0, 1).lines
        assert line.length == pytest.approx(3, rel=1e-3)
        assert_allclose(line.points[:, 1], 0, atol=2e-3)

    def test_of_lines_that_are_not_there_are_refused(self):
        network = sm.feature_lines(CUBE)
        for edit in (network.without, lambda k: network.prolonged(k, angle=0.1), lambda k: network.joined(0, k)):
            for number, error in ((12, ValueError), (-1, ValueError), (1.5, TypeError), ("0", TypeError)):
                with pytest.raises(error, match="line"):
                    edit(number)
        with pytest.raises(ValueError, match="no lines"):
            network.without(*range(12)).without(0)
        with pytest.raises(ValueError, match="free ends"):
            network.joined(0, 1)


class TestFiles:
    def test_json(self, tmp_path):
        network = sm.feature_lines(sm.divided(pv.Cylinder(resolution=3).triangulate().clean(), 0.1))
        network.save(tmp_path / "net.json")
        told = json.loads((tmp_path / "net.json").read_text())
        assert_array_equal(told["nodes"], network.nodes)
        for row, line in zip(told["lines"], network.lines, strict=True):
            assert_array_equal(row["points"], line.points)
            assert_array_equal(row["angle"], line.angle)
            assert_array_equal(network.nodes[row["nodes"]], line.points[[0, -1]])
            assert (row["kind"], row["closed"], row["length"]) == (line.kind, line.closed, line.length)
            assert row["vertices"] == line.vertices.tolist()

    @pytest.mark.parametrize("body", [CUBE, CAN])
    def test_vtp(self, tmp_path, body):
        network = sm.feature_lines(body)
        network.save(tmp_path / "net.vtp")
        read = pv.read(tmp_path / "net.vtp")
        assert read.n_cells == len(network)
        lengths = [read.extract_cells(k).compute_cell_sizes()["Length"].sum() for k in range(read.n_cells)]
        assert_allclose(lengths, [line.length for line in network.lines], rtol=1e-6)
        assert_array_equal(read.cell_data["line"], np.arange(len(network)))
        assert_allclose(read.point_data["angle"], np.concatenate([line.angle for line in network.lines]))
        assert [read.field_data["kinds"][k] for k in read.cell_data["kind"]] == ["C0"] * len(network)

    def test_of_no_lines(self, tmp_path):
        network = sm.feature_lines(sm.sphere(8))
        network.save(tmp_path / "net.json")
        assert json.loads((tmp_path / "net.json").read_text()) == {"nodes": [], "lines": []}
        network.save(tmp_path / "net.vtp")
        assert (tmp_path / "net.vtp").exists()

    def test_of_another_kind_are_refused(self, tmp_path):
        with pytest.raises(ValueError, match=r"\.json or \.vtp, not 'net\.obj'"):
            sm.feature_lines(CUBE).save(tmp_path / "net.obj")
        assert list(tmp_path.iterdir()) == []
