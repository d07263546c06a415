"""Threads share the rows of kernels, each of which is written once; forks and other threads do no harm."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numba
import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh._base import _kernels_rows
from simplexmesh._base._kernels_njit import Kernel
from simplexmesh._base._kernels_rows import SHARED_FROM, Call, Helpers, RowKernel, by_rows
from simplexmesh.motion.targets.surfels._kernels_gaps import Cache
from tests.nightly.marks import nightly

SLOW = ("plane", "quadric", "chen_schmitt", "extended_sine")  # to compile
RING = sm.torus(vertices=2 * SHARED_FROM)


@by_rows(10)
def count_rows(begin, end, visits):
    for i in range(begin, end):
        visits[i] += 1


@pytest.fixture(params=[1, 2, 5])
def threads(request, monkeypatch):
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", request.param)
    return request.param


@pytest.mark.parametrize("count", [0, 1, 9, 10, 11, 137, 10_000])
def test_each_row_is_visited_once(threads, count):
    visits = np.zeros(count + 1, np.int64)
    count_rows(count, visits)
    assert (visits[:count] == 1).all()
    assert visits[count] == 0


def test_few_rows_are_not_shared_and_many_by_all(threads, monkeypatch):
    seen = []

    def kernel(begin, end):
        seen.append((threading.get_ident(), end - begin))
        time.sleep(0.01)

    monkeypatch.setattr(rows := by_rows(10)(lambda begin, end: None), "kernel", kernel)
    rows(9)
    assert seen == [(threading.get_ident(), 9)]
    seen.clear()
    rows(1000)
    assert sum(size for _, size in seen) == 1000
    assert 1 < len({thread for thread, _ in seen}) <= threads or threads == 1


def test_an_error_in_a_thread_is_raised_and_the_others_have_ended(monkeypatch):
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 2)
    active = []

    def kernel(begin, end):
        active.append(begin)
        time.sleep(0.05)
        active.remove(begin)
        if threading.current_thread() is not threading.main_thread():
            raise ZeroDivisionError

    monkeypatch.setattr(rows := by_rows(10)(lambda begin, end: None), "kernel", kernel)
    with pytest.raises(ZeroDivisionError):
        rows(1000)
    assert active == []


@pytest.mark.parametrize("struck", ["main", "other"])
def test_a_ctrl_c_leaves_nothing_behind_that_writes(monkeypatch, struck):
    """It strikes in the main thread's part, or while it waits for another's, again and again."""
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 2)
    begun, ended, entered = [], [], {True: threading.Event(), False: threading.Event()}

    def kernel(begin, end):
        begun.append(begin)
        in_main = threading.current_thread() is threading.main_thread()
        entered[in_main].set()
        assert entered[not in_main].wait(9)  # or one thread might take all parts
        if in_main == (struck == "main"):
            for _ in range(3):
                time.sleep(0.05)
                os.kill(os.getpid(), signal.SIGINT)
        ended.append(begin)

    monkeypatch.setattr(rows := by_rows(10)(lambda begin, end: None), "kernel", kernel)
    with pytest.raises(KeyboardInterrupt):
        rows(1000)
    left, own = len(begun), struck == "main"  # the main thread's own part, which ends as it is struck
    assert len(ended) == left - own
    time.sleep(0.2)
    assert (len(begun), len(ended)) == (left, left - own)


def test_many_users_start_as_many_threads_as_are_wanted(monkeypatch):
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 5)
    monkeypatch.setattr(_kernels_rows, "_helpers", Helpers())
    with ThreadPoolExecutor(8) as users:
        for _ in users.map(lambda _: count_rows(10_000, np.zeros(10_000, np.int64)), range(64)):
            pass
    assert _kernels_rows._helpers.count == 4


def test_where_no_thread_can_be_started_one_does_all(monkeypatch):
    def refuse(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 5)
    monkeypatch.setattr(_kernels_rows, "_helpers", Helpers())
    monkeypatch.setattr(threading.Thread, "start", refuse)
    visits = np.zeros(10_000, np.int64)
    count_rows(10_000, visits)
    assert (visits == 1).all()


def test_a_call_that_has_ended_keeps_no_array():
    visits = np.zeros(9, np.int64)
    held, call = weakref.ref(visits), Call(count_rows.kernel, [(0, 9, visits)])
    del visits
    call.run()
    assert held() is None


def test_a_thread_that_outlives_the_main_one_goes_on():
    code = """if True:
        import threading, numba, simplexmesh as sm
        from simplexmesh._base import _kernels_rows as rows
        numba.config.NUMBA_NUM_THREADS = 2
        ring = sm.torus(vertices=2 * rows.SHARED_FROM)

        def late():
            threading.main_thread().join()
            print(sm.vertex_normals(ring.triangulated(), "area").shape)

        threading.Thread(target=late).start()
    """
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout == "(18000, 3)\n"
    assert "Error" not in out.stderr


def test_what_threads_compile_at_once_is_found_at_each_call(monkeypatch):
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 4)
    rows, asked = by_rows(10)(lambda begin, end, values, out: None), []
    values, ask = np.zeros(3), Kernel._compile_for_args
    values.flags.writeable = False
    monkeypatch.setattr(Kernel, "_compile_for_args", lambda *args: (asked.append(1), ask(*args))[1])
    rows(1000, values, np.zeros(3))
    assert asked
    asked.clear()
    rows(1000, values, np.zeros(3))
    assert not asked


def areas(_: Any = None) -> tuple[float, bool]:
    """The same number everywhere, and whether threads shared the work."""
    total = float(sm.vertex_normals(RING.triangulated(), "area").sum())
    return total, "simplexmesh" in {thread.name for thread in threading.enumerate()}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own(monkeypatch):
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 2)
    expected = areas()
    assert expected[1]
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map_async(areas, range(2)).get(timeout=60) == [expected, expected]


def test_threads_may_run_kernels_and_share_a_target_at_once():
    target, turned = sm.targets.Points(RING.vertices), np.roll(np.arange(RING.n_vertices), 5000)
    meshes = [(RING.vertices[rows], RING.normals[rows]) for rows in (slice(None), turned)]
    expected = [target.gap(*mesh, 1.0) for mesh in meshes]
    with ThreadPoolExecutor(4) as users:
        for k, found in enumerate(users.map(lambda k: target.gap(*meshes[k % 2], 1.0), range(80))):
            np.testing.assert_array_equal(found, expected[k % 2])


# --- the kernels of the library, in parts and in one ---------------------------------------------------------------


def arrays_in(value: Any) -> list[np.ndarray]:
    """The arrays of a tuple, but for what a search remembers, which depends on the order of rows."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, Cache):
        return []
    return [array for part in value for array in arrays_in(part)] if isinstance(value, tuple) else []


def copied(value: Any, known: dict[int, np.ndarray]) -> Any:
    """A copy in which arrays that were one are one again."""
    if isinstance(value, np.ndarray):
        return known.setdefault(id(value), value.copy())
    if isinstance(value, tuple):
        parts = [copied(part, known) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


@pytest.fixture
def compared(monkeypatch):
    """Names of the kernels that ran in one and in parts; each run fails where the parts wrote something else."""
    seen = set()

    def call(self, count, *arguments):
        other = copied(arguments, {})
        self.kernel(0, count, *other)
        for part in (2, 0, 1):
            self.kernel(part * count // 3, (part + 1) * count // 3, *arguments)
        for mine, theirs in zip(arrays_in(arguments), arrays_in(other), strict=True):
            np.testing.assert_array_equal(mine, theirs, err_msg=self.kernel.__name__)
        seen.add(self.kernel.__name__)

    monkeypatch.setattr(RowKernel, "__call__", call)
    return seen


def test_of_motion(compared):
    for data in (sm.targets.Points(RING.vertices), sm.targets.Triangles(RING.triangulated())):
        model = sm.DeformableModel(RING, data, reach=0.3, adaptation=0.05)
        for _ in range(11):
            model.step()
    assert {"frames", "curvature_step", "surfel_gaps", "adapted"} <= compared


def test_of_open_meshes_and_volumes(compared):
    sheet = sm.plane(vertices=2 * SHARED_FROM)
    x, y, z = np.mgrid[-8:9, -8:9, -8:9] / 8.0
    volume = sm.Volume(0.03 * np.cos(3 * x) - z + 0 * y, spacing=0.125, origin=(-1, -1, -1))
    model = sm.DeformableModel(
        sheet, sm.targets.Isosurface(volume, 0.0), reach=0.3, rigidity=np.full(sheet.n_vertices, 2)
    )
    for _ in range(2):
        model.step()
    assert "isosurface_gaps" in compared


@pytest.mark.parametrize(
    "method", ["adaptive", "chen_schmitt", "discrete", "full_quadric", "langer", "simplex_angle", "sine", "taubin"]
)
def test_of_curvature(compared, method):
    ring = sm.torus(vertices=300)
    sm.curvature(ring if method == "simplex_angle" else ring.triangulated(), method=method)
    assert compared


@pytest.mark.parametrize("method", ["area", *nightly(*SLOW)])
def test_of_normals(compared, method):
    sm.vertex_normals(sm.torus(vertices=300).triangulated(), method=method)
    assert compared


def test_of_points_and_features(compared):
    egg, triangles = RING.vertices[::6] * [3, 2, 1], sm.torus(vertices=500).triangulated("dual")
    sm.register(egg[egg[:, 0] > 0], egg)
    noise = 0.001 * np.random.default_rng(0).normal(size=triangles.vertices.shape)
    sm.feature_lines(sm.TriangleMesh(triangles.vertices + noise, triangles.faces))
    assert {"fit_planes", "vote", "refine_motions", "fill_averages"} <= compared
