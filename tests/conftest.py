"""Shared fixtures: the folder of real data, hypothesis profiles, off-screen rendering, the command."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

os.environ["PYVISTA_OFF_SCREEN"] = "true"  # before anything imports pyvista
os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before NumPy: there is a process a core, and threads that wait cost time

# "fast" tries the same examples every time, so that a run can be repeated; "thorough" looks for new ones
settings.register_profile(
    "fast", max_examples=16, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("thorough", max_examples=1000, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fast"))

gc.disable()  # objects made by collecting the tests are all kept; searching them repeatedly is wasted


def pytest_configure():
    """Enable Ctrl-C, which is ignored, by tested commands too, if a shell runs the suite in the background."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish():
    """Exclude the tests themselves from later garbage collections."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session")
def data_folder() -> Path:
    """The folder of real scans and volumes named by SIMPLEXMESH_DATA; the test is skipped without one."""
    named = os.environ.get("SIMPLEXMESH_DATA")
    if not named:
        pytest.skip("set SIMPLEXMESH_DATA to the folder of real data to run this test")
    folder = Path(named)
    if not folder.is_dir():
        pytest.fail(f"SIMPLEXMESH_DATA names {named}, which is not a folder")
    return folder


@pytest.fixture
def command(request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Run the command in this process; return its exit code, output and errors. A module's `COMMAND` goes first."""
    from simplexmesh.cli import app

    first = getattr(request.module, "COMMAND", "").split()

    def run(*arguments: object) -> tuple[int, str, str]:
        code = app.run([*first, *map(str, arguments)])
        return (code, *capsys.readouterr())

    return run


@pytest.fixture
def refused(command: Callable[..., tuple[int, str, str]]) -> Callable[..., str]:
    """Run the command, which ends with code 2 and prints nothing but notes and one sentence; return that."""

    def run(*arguments: object) -> str:
        code, out, err = command(*arguments)
        errors = [line for line in err.splitlines() if not line.startswith("note: ")]
        assert (code, out, len(errors)) == (2, "", 1)
        assert errors[0].startswith("error: ")
        return errors[0]

    return run


@pytest.fixture
def coarse_starts(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Find starts on grids of 48 cells along the longest side, not 128 to 256, except at night."""
    if request.node.get_closest_marker("nightly") is None:
        monkeypatch.setattr("simplexmesh.motion.start.from_points.FINEST", 48)


@pytest.fixture(scope="session", autouse=True)
def _kernels_write_to_nothing_read_only():
    """Check each kernel, at its first call with such types, for writing to arrays that were passed read-only."""
    from simplexmesh._base._kernels_njit import Kernel
    from tests.base.kernel_writes import check

    compiled = Kernel._compile_for_args

    def checked(self, *arguments, **named):
        check(self.py_func, arguments)
        return compiled(self, *arguments, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Kernel, "_compile_for_args", checked)
        yield
