"""`simplexmesh register`: the pose it prints and writes is the one that was applied."""

from __future__ import annotations

import json

import numpy as np
import pytest
import SimpleITK as sitk

import simplexmesh as sm
from simplexmesh.data.io.writing import write
from simplexmesh.motion.start.solid_mesh import isosurface
from tests.recognition import reference as reference

T = np.array([[0, -1.0, 0, 5], [1, 0, 0, 0], [0, 0, 1, -2], [0, 0, 0, 1]])

COMMAND = "register"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("registered")
    mesh = reference.lumpy(12)
    np.savetxt(folder / "source.xyz", mesh.vertices)
    mesh.moved(mesh.vertices @ T[:3, :3].T + T[:3, 3]).save(folder / "target.stl")
    np.savetxt(folder / "few.xyz", mesh.vertices[:20])
    np.savetxt(folder / "large.xyz", 1000 * mesh.vertices)
    return folder


def test_prints_and_writes_the_pose(command, files, tmp_path):
    where, shown = tmp_path / "pose.json", tmp_path / "seen.png"
    code, out, _ = command(files / "source.xyz", files / "target.stl", "-o", where, "--json", "--picture", shown)
    assert code == 0
    facts = json.loads(out)
    assert np.allclose(facts["T_target_source"], T, atol=0.03)
    assert np.allclose(sm.read_poses(where)["source.xyz"], facts["T_target_source"])
    assert not facts["ambiguous"]
    assert shown.stat().st_size > 10_000
    assert sorted(each.name for each in tmp_path.iterdir()) == ["pose.json", "seen.png"]


def test_a_table(command, files):
    code, out, _ = command(files / "source.xyz", files / "target.stl")
    assert code == 0
    assert "overlap" in out
    assert "ambiguous" in out


def test_a_level_is_that_of_the_volume(command, files, tmp_path):
    grid = np.stack(np.meshgrid(*[np.linspace(-2, 2, 40)] * 3, indexing="ij"), axis=-1)
    blobs = ((0, 0, 0), (0.9, 0.3, 0), (-0.2, 0.8, 0.6))
    values = sum(np.exp(-((grid - c) ** 2).sum(axis=-1) / 0.3) for c in blobs)
    image = sitk.GetImageFromArray(np.ascontiguousarray(values.T.astype(np.float32)))
    image.SetSpacing((0.1, 0.1, 0.1))
    sitk.WriteImage(image, str(tmp_path / "blobs.nrrd"))
    vertices, faces = isosurface(values - 0.5, values > 0.5)
    write(tmp_path / "blobs.stl", sm.TriangleMesh(0.1 * vertices @ T[:3, :3].T + T[:3, 3], faces))
    code, out, _ = command(tmp_path / "blobs.nrrd", tmp_path / "blobs.stl", "--level", 0.5, "--json")
    assert code == 0
    assert np.allclose(json.loads(out)["T_target_source"], T, atol=0.03)
    assert command(tmp_path / "blobs.stl", tmp_path / "blobs.nrrd", "--level", 0.5)[0] == 0
    assert command(files / "source.xyz", files / "target.stl", "--level", 0.5)[0] == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("few.xyz", "target.stl"), "source must hold at least 50 points"),
        (("absent.xyz", "target.stl"), "absent.xyz"),
        (("source.xyz", "large.xyz"), "must be in one unit"),
        (("source.xyz", "target.stl", "--label", "3"), "source"),
        (("source.xyz", "target.stl", "-o", "pose.txt"), "--output must end with one of .json"),
    ],
)
def test_bad_input_gets_one_sentence(command, files, words, said):
    code, out, err = command(*(files / word if word.endswith(("xyz", "stl")) else word for word in words))
    assert code == 2
    assert said in err
    assert out == ""
