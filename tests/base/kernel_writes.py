"""The arrays that a kernel writes to, found in its source: for a check that none of them was passed read-only.

Read-only arrays are typed as writable in kernels (`_kernels_njit`), so numba does not prevent writing to them.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
import threading
from collections.abc import Iterator
from functools import cache
from types import FunctionType

from numba.core.registry import CPUDispatcher

# two threads that parse at once make Python 3.11 raise SystemError
ONE_PARSER = threading.RLock()


@cache
def written(function: FunctionType) -> frozenset[str]:
    """The parameters, or `parameter.field`s, whose entries are changed here or by a kernel that is called from here."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    names = aliases(tree)
    found = {path(part, names) for part in ast.walk(tree) if isinstance(part, ast.Subscript) and stored(part)}
    for call in ast.walk(tree):
        if isinstance(call, ast.Call):
            for field, argument in passed(call, function):
                where = path(argument, names)
                found.add(where and where + field)
    parameters = inspect.signature(function).parameters
    return frozenset(name for name in found if name.split(".")[0] in parameters)


def stored(part: ast.Subscript) -> bool:
    """Whether `x[i] = ...` or `x[i] += ...`."""
    return isinstance(part.ctx, ast.Store)


def aliases(tree: ast.AST) -> dict[str, str]:
    """What local names are rows or fields of: `row = rows[i]`, `a, b = pair`."""
    names: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Subscript | ast.Attribute):
            for target in node.targets:
                if isinstance(target, ast.Name):
                    names[target.id] = path(node.value, names)
    return names


def path(node: ast.expr, names: dict[str, str]) -> str:
    """`x` for `x` and `x[i]`, `x.y` for `x.y[i]`, empty for anything but an array."""
    if isinstance(node, ast.Subscript):
        return path(node.value, names)
    if isinstance(node, ast.Attribute):
        return path(node.value, names) and f"{path(node.value, names)}.{node.attr}"
    return names.get(node.id, node.id) if isinstance(node, ast.Name) else ""


def passed(call: ast.Call, function: FunctionType) -> Iterator[tuple[str, ast.expr]]:
    """The arguments of a call to a kernel that it writes to, each with the field it is."""
    kernel = eval_name(call.func, function.__globals__)
    if isinstance(kernel, CPUDispatcher) and kernel.py_func is not function:
        parameters = list(inspect.signature(kernel.py_func).parameters)
        for name in written(kernel.py_func):
            parameter, dot, field = name.partition(".")
            at = parameters.index(parameter)
            if at < len(call.args):
                yield dot + field, call.args[at]


def eval_name(node: ast.expr, names: dict[str, object]) -> object:
    """What `f` or `module.f` is, or None."""
    if isinstance(node, ast.Name):
        return names.get(node.id)
    return getattr(eval_name(node.value, names), node.attr, None) if isinstance(node, ast.Attribute) else None


def read_only(name: str, value: object) -> Iterator[str]:
    """The read-only arrays in an argument, by the names that `written` gives them."""
    if hasattr(value, "_fields"):
        for field in value._fields:
            yield from read_only(f"{name}.{field}", getattr(value, field))
    elif hasattr(value, "flags") and not value.flags.writeable:
        yield name


def check(function: FunctionType, arguments: tuple[object, ...]) -> None:
    """Fail if the kernel would write to one of these that is read-only."""
    for parameter, value in zip(inspect.signature(function).parameters, arguments, strict=False):
        for name in read_only(parameter, value):
            with ONE_PARSER:
                assert name not in written(function), f"{function.__name__} writes to {name}, which is read-only"
