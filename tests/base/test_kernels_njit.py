"""Kernels are compiled once for read-only and writable arrays, and processes may compile the same one at once."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
import threading
from collections import namedtuple
from functools import partial
from itertools import combinations
from pathlib import Path
from types import ModuleType

import numba
import numpy as np
import pytest

import simplexmesh
from simplexmesh._base._kernels_njit import IMPORTED, INNER, CacheFile, njit, source_hash
from tests.base.kernel_writes import check, written

Pair = namedtuple("Pair", ["left", "right"])

ROOT = Path(simplexmesh.__file__).parents[1]
FILES = sorted(ROOT.glob("simplexmesh/**/_kernels*.py"))
PACKAGES = {".".join(file.parent.relative_to(ROOT).parts) for file in ROOT.glob("simplexmesh/**/__init__.py")}


def frozen(values) -> np.ndarray:
    out = np.array(values)
    out.flags.writeable = False
    return out


@njit()
def total(x):
    return x.sum()


@njit()
def fill(out, x):
    row = out[0]
    for i in range(len(x)):
        row[i] = 2 * x[i]


@njit()
def fill_pair(pair, x):
    fill(pair.right, x)


class TestOnce:
    def test_read_only_and_writable_arrays_are_one_type(self):
        for x in (frozen([1.0, 2, 3]), np.array([1.0, 2, 3])):
            assert total(x) == total(x) == 6
        assert len(total.signatures) == 1

    @pytest.mark.parametrize("wrap", [lambda a, b: (a, b), Pair], ids=["tuple", "named"])
    def test_in_tuples_too(self, wrap):
        kernel = njit()(lambda pair: pair[0].sum() - pair[1].sum())
        for left in (np.ones(4), frozen(np.ones(4))):
            for right in (np.ones(3), frozen(np.ones(3))):
                assert kernel(wrap(left, right)) == 1
        assert len(kernel.signatures) == 1

    def test_literals_and_integers_of_all_widths_are_one_type_between_kernels(self):
        twice = njit()(lambda n: n * 2)
        kernel = njit()(lambda ints: twice(1) + twice(3) + twice(len(ints)) + twice(ints[0]))
        assert kernel(np.array([5], np.int32)) == 2 + 6 + 2 + 10
        assert twice.signatures == [(numba.int64,)]

    def test_what_only_kernels_call_cannot_be_called_from_python_until_it_is(self):
        inner = njit()(lambda n: n + 1)
        outer = njit()(lambda n: inner(n) * inner(n * 1.0))
        assert outer(2) == 9
        assert inner.inner == {(numba.int64,), (numba.float64,)}
        code = inner.overloads[(numba.int64,)].library
        assert not code.get_pointer_to_function(inner.overloads[(numba.int64,)].fndesc.llvm_cpython_wrapper_name)
        assert (inner(2), inner(True), outer(3)) == (3, 2, 16)
        assert inner.inner == {(numba.float64,)}
        assert njit()(lambda n: inner(n))(5) == inner(5) == 6
        assert sum(inner.stats.cache_misses.values()) == 4  # one anew
        assert len(inner.signatures) == 3

    def test_types_and_layouts_remain_apart(self):
        kernel = njit()(lambda x: x[0])
        assert kernel(frozen([1, 2])) == 1
        assert kernel(frozen([1.5, 2])) == 1.5
        assert kernel(frozen([1.5, 2, 3, 4])[::2]) == 1.5
        assert len(kernel.signatures) == 3

    def test_numba_alone_compiles_again(self):
        kernel = numba.njit(lambda x: x[0])
        assert kernel(frozen([1, 2])) == kernel(np.array([1, 2])) == 1
        assert len(kernel.signatures) == 2

    def test_without_compiling_functions_stay_what_they_are(self, monkeypatch):
        monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
        assert njit(cache=True)(frozen) is frozen


class TestWrites:
    def test_are_found_in_rows_in_fields_and_in_kernels_called(self):
        assert written(total.py_func) == frozenset()
        assert written(fill.py_func) == {"out"}
        assert written(fill_pair.py_func) == {"pair.right"}

    def test_to_read_only_arrays_are_reported(self):
        out, locked = np.zeros((1, 3)), frozen(np.zeros((1, 3)))
        check(fill_pair.py_func, (Pair(locked, out), frozen([1.0, 2, 3])))
        with pytest.raises(AssertionError, match=r"fill_pair writes to pair.right, which is read-only"):
            check(fill_pair.py_func, (Pair(out, locked), frozen([1.0, 2, 3])))

    def test_the_tests_check_every_kernel(self):
        with pytest.raises(AssertionError, match="fill writes to out, which is read-only"):
            fill(frozen(np.zeros((1, 3))), np.ones(3))


def files(folder: Path, stamp: str = "now") -> CacheFile:
    return CacheFile(str(folder), "kernel", stamp)


class Turns:
    """Two threads that each wait for their turn before they touch a file: processes, in an order that is chosen."""

    def __init__(self, order: tuple[str, ...]) -> None:
        self.order = list(order)
        self.changed = threading.Condition()

    def save(self, name: str, folder: Path) -> None:
        kept = files(folder)
        for step in ("_load_index", "_save_index", "_save_data"):
            setattr(kept, step, partial(self.step, name, getattr(kept, step)))
        kept.save(name, f"code of {name}")
        with self.changed:
            self.order = [turn for turn in self.order if turn != name]
            self.changed.notify_all()

    def step(self, name: str, function, *arguments):
        with self.changed:
            assert self.changed.wait_for(lambda: name not in self.order or self.order[0] == name, timeout=60)
            out = function(*arguments)
            del self.order[:1]
            self.changed.notify_all()
        return out


class TestFiles:
    def test_two_processes_never_give_each_other_the_wrong_code(self, tmp_path):
        lost = 0
        orders = sorted({tuple("two" if i in twos else "one" for i in range(8)) for twos in combinations(range(8), 4)})
        for i, order in enumerate(orders):
            turns, folder = Turns(order), tmp_path / str(i)
            folder.mkdir()
            threads = [threading.Thread(target=turns.save, args=(name, folder)) for name in ("one", "two")]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            kept = {name: files(folder).load(name) for name in ("one", "two")}
            assert set(kept.items()) <= {("one", "code of one"), ("two", "code of two"), ("one", None), ("two", None)}
            lost += list(kept.values()).count(None)
            assert lost <= i + 1
        assert lost < len(orders)

    def test_hold_all_forms_and_none_of_older_source(self, tmp_path):
        files(tmp_path, "before").save("one", 0)
        for name, code in (("one", 1), ("two", 2), ("one", 1)):
            files(tmp_path).save(name, code)
        assert [files(tmp_path).load(name) for name in ("one", "two", "three")] == [1, 2, None]
        assert files(tmp_path, "before").load("one") is None
        assert len(list(tmp_path.iterdir())) == 3

    @pytest.mark.parametrize("lost", ["type", "module"])
    def test_with_a_type_of_an_older_version_are_stale(self, tmp_path, monkeypatch, lost):
        older = ModuleType("older")
        older.Row = type("Row", (), {"__module__": "older"})
        monkeypatch.setitem(sys.modules, "older", older)
        files(tmp_path).save(older.Row, 1)
        assert files(tmp_path).load(older.Row) == 1
        if lost == "type":
            del older.Row
        else:
            monkeypatch.delitem(sys.modules, "older")
        assert files(tmp_path).load("two") is None
        files(tmp_path).save("two", 2)
        assert files(tmp_path).load("two") == 2

    def test_that_return_a_type_of_an_older_version_are_stale(self, tmp_path, monkeypatch):
        older = ModuleType("older")
        older.Row = type("Row", (), {"__module__": "older"})
        monkeypatch.setitem(sys.modules, "older", older)
        files(tmp_path).save("one", older.Row)
        files(tmp_path).save("two", 2)
        assert files(tmp_path).load("one") is older.Row
        del older.Row
        assert files(tmp_path).load("one") is None
        files(tmp_path).save("one", 1)
        assert [files(tmp_path).load(name) for name in ("one", "two")] == [1, 2]

    def test_are_stale_when_an_imported_file_has_changed(self, tmp_path, monkeypatch):
        """As after an upgrade, by which most kernels' own files stay as they are."""
        package = tmp_path / "package"
        package.mkdir()
        kernel = "from simplexmesh._base._kernels_njit import njit\n@njit(cache=True)\n"
        sources = {
            "__init__": "",
            "factors": "FACTOR = 2\n",
            "inner": f"from package.factors import FACTOR\n{kernel}def inner(x):\n    return FACTOR * x\n",
            "outer": f"from package.inner import inner\n{kernel}def outer(x):\n    return 10 * inner(x)\n",
        }
        monkeypatch.syspath_prepend(tmp_path)

        def run(**changed):
            """Import all anew, as a new process does."""
            for name, text in changed.items():
                (package / f"{name}.py").write_text(text)
            for name in [name for name in sys.modules if name.partition(".")[0] == "package"]:
                monkeypatch.delitem(sys.modules, name)
            importlib.invalidate_caches()
            source_hash.cache_clear()
            outer = importlib.import_module("package.outer").outer
            return outer(7), sum(outer.stats.cache_misses.values())

        assert [run(**sources), run()] == [(140, 1), (140, 0)]
        assert run(factors="FACTOR = 30\n") == (2100, 1)
        assert run(inner=sources["inner"].replace("* x", "* x * 15")) == (31500, 1)
        assert run() == (31500, 0)

    @pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
    def test_find_all_imports_of_a_kernel_file(self, file):
        found = {name.decode() for name in IMPORTED.findall(file.read_bytes())}
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                assert not any(alias.name.startswith("simplexmesh") for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module.startswith("simplexmesh") and not node.col_offset:
                assert node.module in found
                assert node.module not in PACKAGES  # a module named after "import" would not be found

    def test_of_what_only_kernels_call_are_given_to_kernels_only(self, tmp_path):
        within, called = files(tmp_path), files(tmp_path)
        within.options = {INNER: True}
        within.save("one", 1)
        assert [within.load("one"), called.load("one")] == [1, None]
        called.save("one", 2)
        called.save("two", 3)
        assert [within.load("one"), called.load("one"), within.load("two")] == [1, 2, 3]

    def test_of_others_are_left_alone(self, tmp_path):
        other = tmp_path / "kernels-1.py311.1.nbc"
        other.write_text("somebody's")
        files(tmp_path).save("one", 1)
        assert other.exists()

    def test_processes_started_together_compute_the_same(self, tmp_path, monkeypatch):
        (tmp_path / "shared.py").write_text(
            "from simplexmesh._base._kernels_njit import njit\n@njit(cache=True)\ndef last(x):\n    return x[-1] * 2\n"
        )
        code = "import numpy as np, sys; from shared import last; print(last(np.array([1, 3], sys.argv[1])))"
        started = [
            subprocess.Popen([sys.executable, "-c", code, kind], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
            for kind in ("f8", "i8")
        ]
        assert [process.communicate(timeout=120)[0].strip() for process in started] == ["6.0", "6"]
        monkeypatch.syspath_prepend(tmp_path)
        last = importlib.import_module("shared").last
        monkeypatch.delitem(sys.modules, "shared")
        assert [str(last(np.array([1, 3], kind))) for kind in ("f8", "i8")] == ["6.0", "6"]
        assert sum(last.stats.cache_misses.values()) == 0
        assert len(list(tmp_path.glob("__pycache__/*.nbc"))) <= 2
