"""A library keeps what was added whatever happens, and tells what a scan shows."""

from __future__ import annotations

import itertools
import os
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import textwrap
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.recognition.library import _kernels_correspondences as correspondences
from simplexmesh.recognition.library import _kernels_descriptors as kernels
from simplexmesh.recognition.library import ranking
from simplexmesh.recognition.library._kernels_descriptors import COSINE_BINS, LENGTH_BINS
from simplexmesh.recognition.library.global_descriptor import global_descriptor
from simplexmesh.recognition.library.model_index import ImageIndex
from simplexmesh.recognition.library.models import HEADER, Model, model_of
from simplexmesh.recognition.library.scene import without_outliers
from simplexmesh.recognition.library.store import Store, _as_os_error
from simplexmesh.recognition.register.oriented_points import oriented_points
from tests.nightly.marks import nightly
from tests.recognition import reference as reference
from tests.recognition.library import reference as plain


def bodies():
    """Five bodies of about one size."""
    cube = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = np.array([[f[0], f[k], f[k + 1]] for f in faces for k in (1, 2)])
    return {
        "lumpy": reference.lumpy(12).triangulated(),
        "other": reference.lumpy(12, seed=4).triangulated(),
        "egg": sm.ellipsoid((1.5, 1.1, 0.8), 12).triangulated(),
        "ring": sm.torus(radius=1.2, tube_radius=0.4).triangulated(),
        "brick": sm.TriangleMesh(cube * [1.3, 1.0, 0.6], triangles),
    }


@pytest.fixture(scope="module")
def known():
    return bodies()


@pytest.fixture(scope="module")
def library(known, tmp_path_factory):
    made = sm.ModelLibrary(tmp_path_factory.mktemp("library") / "models.sml")
    for name, mesh in known.items():
        made.add(name, mesh)
    return made


def scan_of(mesh, share, noise, rng):
    """Points of a body, one side of a random plane, noisy, turned; and the motion."""
    points = mesh.sampled(12_000, rng=rng).points
    size = np.linalg.norm(np.ptp(points, axis=0))
    height = points @ rng.normal(size=3)
    points = points[height <= np.quantile(height, share)]
    points = rng.permutation(points)[:3000] + noise * size * rng.normal(size=(3000, 3))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = reference.random_rotation(rng), rng.normal(size=3)
    return points @ T[:3, :3].T + T[:3, 3], T


class TestRecognition:
    @pytest.mark.parametrize(("share", "noise"), [*nightly((1.0, 0.01), (0.7, 0.005)), (0.5, 0.005)])
    def test_finds_each_body_and_where_it_lies(self, library, known, share, noise):
        rng = np.random.default_rng(3)
        for name, mesh in known.items():
            scan, T = scan_of(mesh, share, noise, rng)
            found = library.recognize(scan)
            assert found[0].name == name
            if name in ("lumpy", "other"):
                assert reference.angle(found[0].T_target_source[:3, :3], T[:3, :3]) < 3
                assert np.linalg.norm(found[0].T_target_source[:3, 3] - T[:3, 3]) < 0.1
                assert found[0].overlap > 0.7
                assert found[0].error < 0.06
            scores = [each.score for each in found]
            assert scores == sorted(scores, reverse=True)

    def test_symmetric_bodies_come_to_lie_on_themselves(self, library, known):
        scan, T = scan_of(known["egg"], 1.0, 0.002, np.random.default_rng(0))
        found = library.recognize(scan)[0]
        back = np.linalg.inv(T) @ found.T_target_source
        at = known["egg"].vertices @ back[:3, :3].T + back[:3, 3]
        assert np.abs(((at / [1.5, 1.1, 0.8]) ** 2).sum(axis=1) - 1).max() < 0.05

    def test_flat_sides_say_little_and_principal_axes_much(self, tmp_path):
        """Of twelve boxes two lay wrongly and three were missed without the motions between principal axes."""

        def box(seed):
            rng = np.random.default_rng(seed)
            at, axis = rng.uniform(-1, 1, (4000, 3)), rng.integers(3, size=4000)
            at[np.arange(4000), axis] = rng.choice([-1, 1], 4000)
            return at * [1, 0.6, 0.35]

        boxes = sm.ModelLibrary(tmp_path / "boxes.lib")
        boxes.add("box", box(0))
        for seed in range(20, 26):
            rotation = Rotation.random(random_state=seed).as_matrix()
            scan = box(seed) @ rotation.T + [3, 1, 2]
            (found,) = boxes.recognize(scan)
            placed = box(0) @ found.T_target_source[:3, :3].T + found.T_target_source[:3, 3]
            assert np.quantile(cKDTree(placed).query(scan)[0], 0.9) < 0.06

    def test_meshes_and_files_are_scans_too(self, library, known, tmp_path):
        assert library.recognize(known["ring"])[0].name == "ring"
        np.savetxt(tmp_path / "scan.xyz", known["brick"].sampled(2000, rng=0).points)
        assert library.recognize(tmp_path / "scan.xyz")[0].name == "brick"

    def test_another_unit_is_another_body(self, library, known):
        scan, _ = scan_of(known["lumpy"], 1.0, 0.002, np.random.default_rng(1))
        assert all(each.score < 0.5 for each in library.recognize(3 * scan))
        one = sm.ModelLibrary(library.path.with_name("small.sml"))
        one.add("lumpy", known["lumpy"].vertices * 1e-3)
        assert one.recognize(scan * 1e-3)[0].score > 0.8

    def test_best_and_least_score(self, library, known):
        scan, _ = scan_of(known["lumpy"], 1.0, 0.002, np.random.default_rng(1))
        assert len(library.recognize(scan, best=2, minimum_score=0.0)) <= 2
        assert [each.name for each in library.recognize(scan, minimum_score=0.6)] == ["lumpy"]

    def test_the_same_twice(self, library, known):
        scan, _ = scan_of(known["other"], 0.6, 0.005, np.random.default_rng(1))
        one, two = library.recognize(scan), library.recognize(scan)
        assert [(each.name, each.score) for each in one] == [(each.name, each.score) for each in two]

    @pytest.mark.nightly
    def test_more_are_tried_where_none_explains_the_scan(self, library, known, monkeypatch):
        monkeypatch.setattr(ranking, "BY_DESCRIPTOR", 1)
        monkeypatch.setattr(ranking, "BY_IMAGES", 0)
        rng = np.random.default_rng(3)
        for name, mesh in known.items():
            assert library.recognize(scan_of(mesh, 0.5, 0.005, rng)[0])[0].name == name

    def test_no_more_are_there_to_be_tried(self, known, monkeypatch, tmp_path):
        monkeypatch.setattr(ranking, "SUFFICIENT_SCORE", 2.0)
        monkeypatch.setattr(ranking, "NEAR_DESCRIPTOR", 9.0)
        library = sm.ModelLibrary(tmp_path / "models.sml")
        library.add("egg", known["egg"])
        assert [each.name for each in library.recognize(known["egg"])] == ["egg"]

    def test_outliers_do_not_matter(self, library, known):
        rng = np.random.default_rng(5)
        scan, _ = scan_of(known["lumpy"], 0.7, 0.005, rng)
        before = library.recognize(scan)[0]
        scan[:60] = scan.mean(axis=0) + rng.uniform(-12, 12, (60, 3))
        found = library.recognize(scan)[0]
        assert found.name == "lumpy"
        assert found.score > before.score - 0.1
        kept = without_outliers(oriented_points(scan, "scan"))
        assert kept.extent < 1.1 * np.linalg.norm(np.ptp(scan[60:], axis=0))
        assert len(kept.on_quadrics().points) == len(kept.normals) == len(kept.smooth) == len(kept) < len(scan)

    def test_sparse_parts_are_no_outliers(self, known):
        points = known["lumpy"].sampled(40_000, rng=0).points
        left = points[:, 0] < 0
        points = np.vstack([points[left][:3000], points[~left][:500]])
        surface = oriented_points(points, "scan")
        assert len(without_outliers(surface)) == len(surface)

    def test_small_models_do_not_explain_large_scans(self, known, tmp_path):
        """A thin plate fits on any flat side, a small ball in noise: neither is what the scan is of."""
        library = sm.ModelLibrary(tmp_path / "models.sml")
        brick, rng = known["brick"], np.random.default_rng(0)
        library.add("brick", brick)
        library.add("plate", sm.TriangleMesh(brick.vertices * [0.12, 0.15, 0.02], brick.faces))
        library.add("ball", sm.sphere(8, radius=0.1))
        found = library.recognize(scan_of(brick, 0.4, 0.01, rng)[0], minimum_score=0.0)
        assert found[0].name == "brick"
        assert all(each.score < 0.1 for each in found[1:])
        small = library.points("plate").points
        assert library.recognize(small)[0].name == "plate"  # as a model of its own it is found

    def test_nothing_is_told_of_models_that_lie_nowhere(self, library):
        found = library.recognize(reference.lumpy(12).vertices * 1e-6, minimum_score=0.0)
        assert all(np.isfinite(each.error) for each in found)

    def test_progress_is_told(self, library, known):
        told = []
        library.recognize(known["ring"], progress=lambda share, message: told.append(share))
        assert told == sorted(told)
        assert told[-1] == 1.0


class TestKeeping:
    def test_names_in_the_order_they_were_added(self, library, known):
        assert list(library) == list(known) == list(library.names)
        assert len(library) == 5
        assert "egg" in library
        assert "cow" not in library
        assert "5 models" in repr(library)

    def test_is_there_when_opened_again(self, library, known):
        assert sm.ModelLibrary(str(library.path)).names == tuple(known)
        assert sorted(each.name for each in library.path.parent.glob("models*")) == ["models.sml"]

    def test_a_name_is_taken_once_unless_it_is_replaced(self, known, tmp_path):
        library = sm.ModelLibrary(tmp_path / "models.sml")
        library.add("egg", known["lumpy"])
        with pytest.raises(ValueError, match="must be new to the library, not 'egg'"):
            library.add("egg", known["egg"])
        assert library.recognize(known["lumpy"])[0].score > 0.9
        library.add("egg", known["egg"], replace=True)
        assert len(library) == 1
        assert library.recognize(known["egg"])[0].score > 0.9

    def test_removed_is_gone(self, known, tmp_path):
        library = sm.ModelLibrary(tmp_path / "models.sml")
        library.add("egg", known["egg"])
        library.add("ring", known["ring"])
        library.recognize(known["egg"])
        library.remove("egg")
        assert list(library) == ["ring"]
        assert "egg" not in [each.name for each in library.recognize(known["egg"], minimum_score=0.0)]
        with pytest.raises(ValueError, match=r"must be that of a model .*, not 'egg'"):
            library.remove("egg")

    def test_what_others_add_and_replace_is_seen(self, known, tmp_path):
        one, other = sm.ModelLibrary(tmp_path / "models.sml"), sm.ModelLibrary(tmp_path / "models.sml")
        one.add("egg", known["egg"])
        assert other.recognize(known["egg"])[0].name == "egg"
        one.add("ring", known["ring"])
        assert other.recognize(known["ring"])[0].name == "ring"
        one.path.unlink()
        one.add("brick", known["brick"])
        one.add("lumpy", known["lumpy"])
        assert list(other) == ["brick", "lumpy"]
        assert other.recognize(known["brick"])[0].name == "brick"

    def test_a_copy_put_in_its_place_is_seen(self, known, tmp_path):
        """A backup goes on counting from where it was made: as many changes, the same numbers, other models."""
        library, backup = sm.ModelLibrary(tmp_path / "models.sml"), tmp_path / "backup.sml"
        library.add("brick", known["brick"])
        shutil.copy(library.path, backup)
        library.add("egg", known["egg"])
        assert library.recognize(known["egg"])[0].score > 0.9
        sm.ModelLibrary(backup).add("ring", known["ring"])
        os.replace(backup, library.path)
        assert [each.name for each in library.recognize(known["egg"], minimum_score=0.5)] == []
        assert library.recognize(known["ring"])[0].name == "ring"
        assert np.abs(library.points("ring").points[:, 2]).max() < 0.45

    def test_a_file_that_was_only_begun_can_be_added_to(self, known, tmp_path):
        path = tmp_path / "models.sml"
        path.touch()  # all that a crash leaves that comes while the first model is being written
        library = sm.ModelLibrary(path)
        assert list(library) == []
        with pytest.raises(OSError, match=r"models.sml is empty, not a model library"):
            library.recognize(known["egg"])
        library.add("egg", known["egg"])
        assert list(sm.ModelLibrary(path)) == ["egg"]

    def test_removing_nothing_changes_nothing(self, library):
        before = library.path.read_bytes()
        with pytest.raises(ValueError, match=r"must be that of a model .*, not 'cow'"):
            library.remove("cow")
        assert library.path.read_bytes() == before

    def test_points_of_a_model(self, library):
        cloud = library.points("ring")
        x, y, z = cloud.points.T
        assert np.abs(np.hypot(np.hypot(x, y) - 1.2, z) - 0.4).max() < 0.05
        with pytest.raises(ValueError, match=r"must be that of a model .*, not 'cow'"):
            library.points("cow")

    def test_a_reader_reads_while_another_writes(self, library, known):
        held = sqlite3.connect(library.path, isolation_level=None)
        held.execute("BEGIN IMMEDIATE")
        try:
            assert sm.ModelLibrary(library.path).recognize(known["ring"])[0].name == "ring"
        finally:
            held.execute("ROLLBACK")
            held.close()


@contextmanager
def python(source, *arguments):
    """Run Python on a source."""
    with subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(source), *map(str, arguments)], stdout=subprocess.PIPE, text=True
    ) as started:
        yield started


class TestCrashes:
    def test_what_was_added_survives_a_kill(self, tmp_path):
        path = tmp_path / "models.sml"
        source = """
            import sys
            import simplexmesh as sm
            egg, library = sm.ellipsoid((3, 2, 1), 10), sm.ModelLibrary(sys.argv[1])
            for k in range(10_000):
                library.add(f"egg {k}", egg)
                print(k, flush=True)
            """
        with python(source, path) as adding:
            done = [adding.stdout.readline() for _ in range(4)]
            adding.kill()
            done += adding.stdout.readlines()
        names = sm.ModelLibrary(path).names
        assert names[: len(done)] == tuple(f"egg {k}" for k in range(len(done)))
        assert len(names) - len(done) in (0, 1)  # the last may be on disk and not yet told
        assert sm.ModelLibrary(path).recognize(sm.ellipsoid((3, 2, 1), 12))[0].score > 0.9

    @pytest.mark.parametrize("first", [False, True])
    def test_in_the_middle_of_adding(self, tmp_path, known, first):
        path = tmp_path / "models.sml"
        if not first:
            sm.ModelLibrary(path).add("ring", known["ring"])
        source = """
            import os, signal, sys
            from pathlib import Path
            from simplexmesh.recognition.library.store import Store
            Store._commit = staticmethod(lambda file: os.kill(os.getpid(), signal.SIGKILL))
            Store(Path(sys.argv[1])).put("egg", bytes(20_000_000), replace=False)  # more than is held in memory
            """
        with python(source, path) as adding:
            assert adding.wait() == -signal.SIGKILL
        if not first:
            assert path.stat().st_size > 10_000_000  # it was in the file already
        library = sm.ModelLibrary(path)
        assert list(library) == ([] if first else ["ring"])
        library.add("egg", known["egg"])
        assert library.recognize(known["egg"])[0].name == "egg"

    def test_two_add_at_the_same_time(self, tmp_path):
        source = """
            import sys
            from pathlib import Path
            from simplexmesh.recognition.library.store import Store
            for k in range(40):
                Store(Path(sys.argv[1])).put(f"{sys.argv[2]} {k}", bytes(50_000), replace=False)
            """
        path = tmp_path / "models.sml"
        with python(source, path, "one") as one, python(source, path, "other") as other:
            assert (one.wait(), other.wait()) == (0, 0)
        names = list(sm.ModelLibrary(path))
        assert sorted(names) == sorted(f"{name} {k}" for name in ("one", "other") for k in range(40))


class TestBadInput:
    @pytest.mark.parametrize("length", [0, 60, 700, 5000, -1, -5000])
    def test_cut_short(self, library, known, tmp_path, length):
        whole = library.path.read_bytes()
        path = tmp_path / "cut.sml"
        path.write_bytes(whole[:length])
        with pytest.raises(OSError, match=r"cut.sml is (empty, not a|not a whole) model library|cut.sml is damaged"):
            sm.ModelLibrary(path).recognize(known["egg"])

    def test_damaged_inside(self, library, known, tmp_path):
        whole = bytearray(library.path.read_bytes())
        at = len(whole) // 2
        whole[at : at + 50] = bytes(50)
        path = tmp_path / "damaged.sml"
        path.write_bytes(whole)
        with pytest.raises(OSError, match=r"damaged.sml is (damaged: the data of|not a whole model library)"):
            sm.ModelLibrary(path).recognize(known["egg"])

    @pytest.mark.parametrize("how", ["short", "long", "chosen", "side", "descriptor"])
    def test_a_model_that_is_none_is_refused(self, known, tmp_path, how):
        """Its checksum is right: somebody meant it, or an older version wrote it so."""
        packed = model_of(oriented_points(known["brick"].sampled(800, rng=0), "data")).packed()
        chosen = HEADER.size + 12 * 800
        wrong = {
            "short": packed[:-4],
            "long": packed + b"more",
            "chosen": packed[:chosen] + b"\xff\xff" + packed[chosen + 2 :],
            "side": packed[:32] + bytes(8) + packed[40:],
            "descriptor": packed[:-4] + struct.pack("<f", np.nan),
        }[how]
        Store(tmp_path / "models.sml").put("brick", wrong, replace=False)
        with pytest.raises(OSError, match=r"models.sml is damaged: a model (is truncated|holds invalid values)"):
            sm.ModelLibrary(tmp_path / "models.sml").recognize(known["brick"])

    def test_not_a_library(self, known, tmp_path):
        (tmp_path / "text.sml").write_text("cow\n" * 1000)
        with pytest.raises(OSError, match=r"text.sml is not a whole model library: file is not a database"):
            sm.ModelLibrary(tmp_path / "text.sml")
        other = sqlite3.connect(tmp_path / "other.sml")
        other.execute("CREATE TABLE models (name TEXT)")
        other.close()
        for use in (sm.ModelLibrary, lambda path: sm.ModelLibrary(path).add("egg", known["egg"])):
            with pytest.raises(OSError, match="is a database of another program"):
                use(tmp_path / "other.sml")

    def test_of_another_version(self, library, tmp_path):
        path = tmp_path / "newer.sml"
        path.write_bytes(library.path.read_bytes())
        later = sqlite3.connect(path)
        later.execute("PRAGMA user_version = 7")
        later.close()
        with pytest.raises(OSError, match="has format version 7"):
            sm.ModelLibrary(path)

    def test_absent_or_elsewhere(self, known, tmp_path):
        library = sm.ModelLibrary(tmp_path / "absent.sml")
        assert len(library) == 0
        with pytest.raises(FileNotFoundError, match="there is no model library"):
            library.recognize(known["egg"])
        assert not library.path.exists()
        with pytest.raises(FileNotFoundError, match="there is no folder"):
            sm.ModelLibrary(tmp_path / "nowhere" / "models.sml")
        with pytest.raises(IsADirectoryError, match="is a folder"):
            sm.ModelLibrary(tmp_path)
        with pytest.raises(TypeError, match="path must be a string or a Path, not int"):
            sm.ModelLibrary(7)

    def test_an_empty_library(self, known, tmp_path):
        library = sm.ModelLibrary(tmp_path / "models.sml")
        library.add("egg", known["egg"])
        library.remove("egg")
        with pytest.raises(ValueError, match="must hold models to recognize anything; it is empty"):
            library.recognize(known["egg"])

    @pytest.mark.parametrize(
        ("scan", "said"),
        [
            (np.random.default_rng(0).normal(size=(20, 3)), "data must hold at least 50 points"),
            (np.linspace(0, 1, 300)[:, None] * [1.0, 2, 3], "lie on a line"),
            (np.full((100, 3), np.nan), "finite"),
            (np.zeros((100, 2)), "shape"),
        ],
    )
    def test_scans_and_models_that_cannot_be(self, library, scan, said):
        with pytest.raises(ValueError, match=said):
            library.recognize(scan)
        with pytest.raises(ValueError, match=said):
            library.add("cow", scan)
        assert "cow" not in library

    @pytest.mark.parametrize(("name", "kind"), [(7, TypeError), ("", ValueError), ("a\nb", ValueError)])
    def test_names(self, library, known, name, kind):
        with pytest.raises(kind, match="name must be"):
            library.add(name, known["egg"])
        with pytest.raises(kind, match="name must be"):
            library.remove(name)

    @pytest.mark.parametrize("options", [{"best": 0}, {"minimum_score": 2.0}, {"inside": "left"}])
    def test_options(self, library, known, options):
        with pytest.raises(ValueError, match=f"{next(iter(options))} must be"):
            library.recognize(known["egg"], **options)

    @pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
    def test_a_folder_that_cannot_be_written_to_can_be_read(self, library, known, tmp_path):
        path = tmp_path / "models.sml"
        path.write_bytes(library.path.read_bytes())
        tmp_path.chmod(0o500)
        try:
            assert sm.ModelLibrary(path).recognize(known["ring"])[0].name == "ring"
            with pytest.raises(OSError, match="cannot be used now"):
                sm.ModelLibrary(path).add("egg again", known["egg"])
        finally:
            tmp_path.chmod(0o700)


seeds = st.integers(0, 2**32 - 1)


def random_oriented(rng, count):
    normals = rng.normal(size=(count, 3))
    return rng.normal(size=(count, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)


@settings(max_examples=10)
@given(seeds)
def test_kernels_do_what_plain_code_does(seed):
    rng = np.random.default_rng(seed)
    points, normals = random_oriented(rng, 40)
    chosen = rng.permutation(40)[:6]
    images = np.zeros((6, kernels.RADIAL_BINS * kernels.AXIAL_BINS))
    kernels.spin_images(len(chosen), points, normals, chosen, 1.3, images)
    shape = kernels.RADIAL_BINS, kernels.AXIAL_BINS
    np.testing.assert_allclose(images, plain.spin_images(points, normals, chosen, 1.3, shape), atol=1e-9)

    pairs = np.zeros((kernels.LENGTH_BINS, kernels.COSINE_BINS))
    kernels.pair_histogram(points, normals, 3.0, pairs)
    np.testing.assert_array_equal(pairs, plain.pair_histogram(points, normals, 3.0, pairs.shape))

    moved = points + 0.1 * rng.normal(size=points.shape)
    degree, found = np.zeros(40), np.zeros((1000, 2), np.int64)
    scan, model, limits = np.hstack([points, normals]), np.hstack([moved, normals]), (0.5, 0.1, 0.1)
    count = correspondences.consistent_pairs(scan, model, correspondences.Tolerances(*limits), degree, found)
    expected = plain.consistent_pairs(points, normals, moved, normals, *limits)
    assert [tuple(pair) for pair in found[:count].tolist()] == expected
    np.testing.assert_array_equal(degree, np.bincount(np.ravel(expected).astype(int), minlength=40))

    rows, queries = rng.normal(size=(30, 8)).astype(np.float32), rng.normal(size=(5, 8)).astype(np.float32)
    squares, starts = (rows**2).sum(axis=1), np.array([0, 12, 13, 30])
    out = np.full((3, 5), np.inf, np.float32)
    kernels.nearest(len(starts) - 1, rows, squares, starts, np.ascontiguousarray(queries.T), out)
    expected = plain.squared_distances(rows, queries)
    least = [expected[a:b].min(axis=0) for a, b in itertools.pairwise(starts)]
    np.testing.assert_allclose(out + (queries**2).sum(axis=1), least, atol=1e-4)
    nearest = np.zeros((5, 2), np.int64)
    kernels.two_nearest(rows, squares, queries, nearest)
    np.testing.assert_array_equal(nearest, np.argsort(expected, axis=0)[:2].T)


@settings(max_examples=10)
@given(seeds, st.sampled_from([20, 5000]))
def test_motions_of_pairs_are_those_plain_code_finds(seed, most):
    """Of several models at once: two that have images, around one that has none."""
    rng = np.random.default_rng(seed)
    p, n = random_oriented(rng, 12)
    distinctiveness, queries = rng.random(12), rng.normal(size=(12, 8)).astype(np.float32)
    q, m = random_oriented(rng, 33)
    q[:12], q[20:32], m[:12], m[20:32] = p + 0.05, p - 0.05, n, n
    rows = rng.normal(size=(33, 8)).astype(np.float32)
    rows[:12], rows[20:32] = queries + 0.1, queries - 0.1
    spans, tolerances = (
        np.array([[0, 12], [0, 0], [12, 33]]),
        np.array([[0.3, 0.2, 0.5], [0.3, 0.2, 0.5], [0.5, 0.4, 0.5]]),
    )
    motions, counts, squares = np.zeros((3, most, 12)), np.zeros(3, np.int64), (rows**2).sum(axis=1)
    starts = np.array([0, 12, 12])
    likeness = correspondences.Likeness(queries, rows, squares, spans)
    scan, models = np.hstack([p, n]), np.hstack([q, m])
    correspondences.pair_motions(
        len(starts), scan, distinctiveness, models, starts, likeness, tolerances, motions, counts
    )
    assert counts[1] == 0
    for k in (0, 2):
        mine = slice(*spans[k])
        expected = plain.pair_motions(
            p, n, distinctiveness, queries, rows[mine], q[mine], m[mine], *tolerances[k], most
        )
        assert counts[k] == len(expected) > 0
        apart = np.abs(motions[k, : counts[k], None] - expected[None]).max(axis=2)
        assert max(apart.min(axis=0).max(), apart.min(axis=1).max()) < 1e-9


def test_images_and_descriptors_do_not_change_with_the_pose(known):
    rng = np.random.default_rng(0)
    cloud = known["lumpy"].sampled(2000, rng=rng)
    R = reference.random_rotation(rng)
    moved = sm.PointCloud(cloud.points @ R.T + [3, -2, 1], cloud.normals @ R.T)
    one, other = (model_of(oriented_points(each, "data")) for each in (cloud, moved))
    np.testing.assert_allclose(one.descriptor, other.descriptor, atol=2e-2)
    assert np.abs(one.spin_images.pixels.astype(int) - other.spin_images.pixels).mean() < 0.5
    assert not np.allclose(one.descriptor, global_descriptor(oriented_points(known["other"], "data")), atol=2e-2)


def test_histograms_of_a_descriptor_hold_the_most_slender_bodies_and_waste_no_bins():
    turns = np.linspace(0, 600, 4000)
    out = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    rod = oriented_points(sm.PointCloud(out + turns[:, None] * [0, 0, 0.1], out), "data")
    lengths = global_descriptor(rod)[: LENGTH_BINS * COSINE_BINS].reshape(LENGTH_BINS, COSINE_BINS)
    filled = lengths.any(axis=1).nonzero()[0]
    assert 0.8 * LENGTH_BINS < len(filled) == filled[-1] + 1 < LENGTH_BINS


def test_a_model_packed_and_unpacked(known):
    surface = oriented_points(known["brick"].sampled(1500, rng=0), "data")
    model = model_of(surface)
    np.testing.assert_allclose(model.surface().points, surface.smooth, atol=3e-5)
    np.testing.assert_allclose(model.surface().normals, surface.normals, atol=1e-4)
    at = model.surface(model.frame[0], 2.0)
    middle, axes, extent = model.frame
    np.testing.assert_allclose(at.points * 2 + middle, model.surface().points, atol=1e-12)
    np.testing.assert_allclose(at.normals, model.surface().normals, atol=1e-12)
    assert (at.spacing, at.noise) == (model.spacing / 2, model.noise / 2)
    assert extent == pytest.approx(model.surface().extent)
    assert np.linalg.det(axes) == pytest.approx(1)
    spread = axes @ at.points.T @ at.points @ axes.T
    np.testing.assert_allclose(spread, np.diag(np.sort(np.diag(spread))[::-1]), atol=1e-9)
    again = Model.unpacked(model.packed())
    for name in ("quantized_points", "quantized_normals", "low", "side", "spacing", "noise", "descriptor"):
        np.testing.assert_array_equal(getattr(again, name), getattr(model, name))
    np.testing.assert_array_equal(again.spin_images.pixels, model.spin_images.pixels)
    np.testing.assert_array_equal(again.spin_images.chosen, model.spin_images.chosen)
    assert again.spin_images.first_octave == model.spin_images.first_octave


def test_few_components_keep_the_nearest(known):
    """Distances in the components that are kept are hardly less than in all."""
    models = [model_of(oriented_points(mesh, name)) for name, mesh in known.items()]
    octave = models[0].spin_images.first_octave + 1
    images = ImageIndex.of(models, octave)
    queries = models[1].spin_images.at(octave)[:20]
    found = images.nearest(queries)
    whole = np.array([plain.squared_distances(model.spin_images.at(octave), queries).min(axis=0) for model in models])
    assert (found <= whole + 1e-4).all()
    assert found[1].max() < 1e-4
    np.testing.assert_allclose(np.sqrt(np.maximum(found, 0)), np.sqrt(whole), atol=0.12)
    (low, high), none = images.spans(np.array([1, 9]))
    nearest = np.zeros((20, 2), np.int64)
    kernels.two_nearest(images.rows[low:high], images.squares[low:high], images.reduced(queries), nearest)
    assert nearest[:, 0].tolist() == list(range(20))
    assert none[0] == none[1]
    assert (ImageIndex.of(models, 99).spans(np.array([0, 1])) == 0).all()


@pytest.mark.nightly
@pytest.mark.parametrize(("share", "noise"), [(1.0, 0.01), (0.5, 0.005)])
def test_real_bodies(data_folder, tmp_path, share, noise):
    library = sm.ModelLibrary(tmp_path / "models.sml")
    meshes = {}
    for name in ("spot.obj", "elephant.off", "femur.off", "fandisk.off", "anchor.off"):
        mesh = sm.read_triangles(data_folder / name)
        meshes[name] = sm.TriangleMesh(mesh.vertices / np.linalg.norm(np.ptp(mesh.vertices, axis=0)), mesh.faces)
        library.add(name, meshes[name])
    rng = np.random.default_rng(1)
    for name, mesh in meshes.items():
        scan, T = scan_of(mesh, share, noise, rng)
        found = library.recognize(scan)[0]
        assert found.name == name
        assert reference.angle(found.T_target_source[:3, :3], T[:3, :3]) < 4


@pytest.mark.parametrize("message", ["database or disk is full", "disk I/O error"])
def test_a_full_disk_is_no_damage(message):
    found = _as_os_error(Path("a.sml"), sqlite3.OperationalError(message))
    assert str(found) == f"a.sml cannot be used now: {message}"
