"""Machine code is generated only for kernels called from Python, and computes the same as numba's own."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter

import numba
import numpy as np
import pytest
from numba import prange
from numba.core import codegen, compiler

from simplexmesh._kernels_lazy import Flags
from simplexmesh._kernels_njit import njit


@njit(error_model="numpy")
def power(x, exponent):
    out = 1.0
    for _ in range(exponent):
        out *= x
    return out


@njit(error_model="numpy")
def polynomial(x, out, degree):
    for i in range(len(x)):
        out[i] = power(x[i], 2) + power(x[i], degree) + power(x[i], np.int32(1))


@njit(error_model="numpy", parallel=True)
def polynomial_parallel(x, out, degree):
    sums = np.zeros(len(x))
    for i in prange(len(x)):
        sums[i] = power(x[i], 2) + power(x[i], degree)
        out[i] = sums[i] + power(x[i], 1)


def library(kernel):
    (compiled,) = kernel.overloads.values()
    return compiled.library


X = np.arange(4.0)


@pytest.mark.parametrize("kernel", [polynomial, polynomial_parallel])
def test_helpers_are_linked_in_and_not_translated(kernel):
    out = np.zeros(4)
    kernel(X, out, 3)
    np.testing.assert_array_equal(out, X**2 + X**3 + X)
    assert library(kernel).translated
    assert power.callee.overloads
    for compiled in power.callee.overloads.values():
        assert not compiled.library.translated
        assert compiled.library._compiled_object is None


def test_helpers_can_be_called_before_and_after():
    kernel = njit()(lambda x: power(x, 2))
    assert power(3.0, 2) == kernel(3.0) == power(3.0, 2) == 9.0


def test_inlined_kernels_have_no_callee():
    inner = njit(inline="always")(lambda x: x + 1.0)
    assert inner.callee is None
    assert njit()(lambda x: 2.0 * inner(x))(1.0) == 4.0


def test_numba_is_as_before_afterwards():
    polynomial(X, np.zeros(4), 3)
    alone = numba.njit(lambda x: x + 1)
    assert alone(1) == 2
    assert compiler.Flags is not Flags
    assert type(library(alone)) is codegen.JITCodeLibrary


def test_errors_leave_numba_as_before():
    with pytest.raises(numba.TypingError):
        njit()(lambda x: x.nothing)(1.0)
    assert compiler.Flags is not Flags


def test_addresses_requested_later_are_of_machine_code():
    """As numba does when a function is passed as a value."""
    inner = numba.njit(lambda x: 3.0 * x)
    assert njit()(lambda x: inner(x))(2.0) == 6.0
    assert numba.njit(lambda f, x: f(x))(inner, 2.0) == inner(2.0) == 6.0
    apply = numba.njit("f8(FunctionType(f8(f8)), f8)")(lambda f, x: f(x))
    assert apply(inner, 2.0) == 6.0


def test_slices_of_another_shape_are_errors_without_text_in_the_kernel():
    @njit()
    def assign(out, x):
        out[1:] = x

    out = np.zeros(3)
    assign(out, np.ones(2))
    assert out.tolist() == [0, 1, 1]
    with pytest.raises(ValueError, match="cannot assign slice from input of different"):
        assign(out, np.ones(3))
    assert "unicode" not in assign.overloads[next(iter(assign.overloads))].library.get_llvm_str()
    with pytest.raises(ValueError, match=r"cannot assign slice (of shape|from input of different size)"):
        numba.njit(assign.py_func)(out, np.ones(3))


def test_later_versions_of_numba_compile_as_they_do_by_themselves(tmp_path):
    """Without anything of this module, which relies on the internals of the versions it is tested with."""
    (tmp_path / "kernels.py").write_text(
        "import sys, numba\n"
        "numba.version_info = numba.version_info._replace(short=(0, 69))\n"
        "from simplexmesh._kernels_njit import njit\n"
        "@njit()\ndef twice(x):\n    return 2 * x\n"
        "@njit(parallel=True)\ndef sixfold(x):\n    return 3 * twice(x)\n"
        "print(sixfold(7), twice.callee, 'simplexmesh._kernels_lazy' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-W", "ignore", "kernels.py"], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.split() == ["42", "None", "False"], done.stderr


def test_flags_are_equal_where_numba_says_so():
    plain = [compiler.Flags(), compiler.Flags(), compiler.Flags()]
    plain[1].nrt = plain[2].nrt = True
    quick = [Flags(flags) for flags in plain]
    for i in range(3):
        for j in range(3):
            assert (quick[i] == quick[j]) == (plain[i] == plain[j]) == (quick[i] == plain[j])
            assert quick[i] != quick[j] or hash(quick[i]) == hash(quick[j])
    assert quick[1].get_mangle_string() == plain[1].get_mangle_string()


def test_another_process_finds_all_in_the_cache(tmp_path):
    (tmp_path / "kernels.py").write_text(
        "from simplexmesh._kernels_njit import njit\n"
        "@njit(cache=True)\ndef twice(x):\n    return 2 * x\n"
        "@njit(cache=True)\ndef sixfold(x):\n    return 3 * twice(x)\n"
        "@njit(cache=True)\ndef tenfold(x):\n    return 5 * twice(x)\n"
    )
    told = Counter()
    for name in ("sixfold", "sixfold", "tenfold", "tenfold", "twice", "twice"):
        code = (
            f"import kernels; print(kernels.{name}(7), sum(kernels.{name}.stats.cache_misses.values()),"
            " sum(kernels.twice.callee.stats.cache_misses.values()))"
        )
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
        told[name, *map(int, done.stdout.split())] += 1
    assert told == {
        **{("sixfold", 42, 1, 1): 1, ("sixfold", 42, 0, 0): 1},
        **{("tenfold", 70, 1, 0): 1, ("tenfold", 70, 0, 0): 1},  # it finds the helper of the other
        **{("twice", 14, 1, 0): 1, ("twice", 14, 0, 0): 1},
    }
