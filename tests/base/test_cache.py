"""Kernels are cached where only the temporary folder is writable."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import simplexmesh
from simplexmesh._base import cache

NOBODY = 65534
PACKAGE = Path(simplexmesh.__file__).parent
CODE = """
import functools
import os
import simplexmesh as sm
from simplexmesh.mesh import _kernels
print(sm.__file__)
print(os.environ.get("NUMBA_CACHE_DIR"))
print(type(_kernels.rings._cache._impl.locator).__name__)
"""


def output_of(folder: Path, home: Path, **more: str) -> list[str]:
    """The words printed by Python run as user nobody, with the package copied to `folder`."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA", "XDG", "PYTHON"))}
    environment |= {"HOME": str(home), "PYTHONPATH": str(folder), "TMPDIR": str(folder / "temporary"), **more}
    user = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]
    done = subprocess.run(
        [*user, sys.executable, "-c", CODE], capture_output=True, text=True, env=environment, cwd=folder, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@functools.cache
def nobody_runs_python() -> bool:
    """Whether the interpreter and numba are where all may read them."""
    user = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]
    done = subprocess.run([*user, sys.executable, "-c", "import numba"], capture_output=True, check=False, cwd="/")
    return done.returncode == 0


@pytest.fixture
def closed():
    """A copy of the package that user nobody can only read, a home that it cannot write, a temporary folder."""
    if shutil.which("setpriv") is None or not hasattr(os, "getuid") or os.getuid() != 0:
        pytest.skip("needs root and setpriv to run as another user")
    if not nobody_runs_python():
        pytest.skip("user nobody cannot run this Python")
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    shutil.copytree(PACKAGE, folder / "simplexmesh", ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "temporary").mkdir()
    (folder / "temporary").chmod(0o777)
    (folder / "home").mkdir(mode=0o755)
    yield folder
    shutil.rmtree(folder)


class TestReadOnlyPackage:
    def test_a_private_temporary_folder_is_used(self, closed):
        where, folder, _ = output_of(closed, closed / "home")
        assert where.startswith(str(closed))
        assert folder == str(closed / "temporary" / f"simplexmesh-numba-{NOBODY}")
        assert (Path(folder).stat().st_uid, Path(folder).stat().st_mode & 0o777) == (NOBODY, 0o700)

    def test_the_folder_of_another_user_is_not_trusted(self, closed):
        planted = closed / "temporary" / f"simplexmesh-numba-{NOBODY}"
        planted.mkdir()
        planted.chmod(0o777)
        _, folder, _ = output_of(closed, closed / "home")
        assert folder != str(planted)
        assert folder.startswith(str(closed / "temporary"))

    def test_a_folder_set_by_the_user_is_kept(self, closed):
        mine = str(closed / "temporary" / "mine")
        assert output_of(closed, closed / "home", NUMBA_CACHE_DIR=mine)[1] == mine

    def test_a_writable_home_is_left_to_numba(self, closed):
        (closed / "home").chmod(0o777)
        _, folder, locator = output_of(closed, closed / "home")
        assert (folder, locator) == ("None", "UserWideCacheLocator")


def test_nothing_is_changed_where_the_package_is_writable(monkeypatch, tmp_path):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(cache, "_writable", lambda folder: folder.name == "__pycache__")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    cache.ensure()
    assert "NUMBA_CACHE_DIR" not in os.environ
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_must_not_be_searched_is_not_writable(monkeypatch):
    def refused(self):
        raise PermissionError(13, "permission denied")

    monkeypatch.setattr(Path, "exists", refused)
    assert not cache._writable(Path("/closed/.cache/numba"))
