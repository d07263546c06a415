"""Draw faults, put each in a copy of the repository, run the tests near it, and print which survive.

    python tests/mutants.py --count 30 --seed 0

The nearest tests run first: files that name the function with the fault or its module, then its folder, then the rooms
of it and of the modules that import it.

A fault is one change of one expression: a comparison flipped, + and - or * and / swapped, a number changed by half or
by one, a sign or a `not` dropped, a condition negated, `and` and `or` swapped, a call left out. Messages, docstrings,
types, plots and the command are left out. A fault with which tests do not end in time is told apart: an endless loop is
noticed by whoever waits, but no test says so.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("_base", "numerics", "mesh", "data", "orientation", "motion", "surface", "recognition", "cloud")
KERNELS = ".kernels"
"""The folder of the compiled kernels in the copy."""

NEAREST = 6
"""Test files that run first."""

TESTED = {f"tests/{room.strip('_')}" for room in ROOMS}
AT_LEAST = 0.9
CAUGHT, SURVIVED, ENDLESS = "caught", "SURVIVED", "ENDLESS"
COMPARED = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
SWAPPED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And}
SILENT = {"warn", "report", "update", "TypeVar", "field"}


def is_told(node: ast.AST) -> bool:
    """Whether a node is a message or a report, an import or a representation: no fault is put in."""
    if isinstance(node, ast.Call):
        return getattr(node.func, "id", "") in SILENT or getattr(node.func, "attr", "") == "report"
    if isinstance(node, ast.If) and isinstance(node.test, ast.Name):
        return node.test.id == "TYPE_CHECKING"
    told = ast.Raise | ast.Assert | ast.JoinedStr | ast.ImportFrom | ast.Import
    return isinstance(node, told) or (isinstance(node, ast.FunctionDef) and node.name == "__repr__")


def parts(node: ast.AST) -> list[ast.AST]:
    """The children of a node, without annotations and decorators."""
    if isinstance(node, ast.AnnAssign):
        return [node.value] if node.value else []
    if isinstance(node, ast.FunctionDef):
        return [*node.args.defaults, *filter(None, node.args.kw_defaults), *node.body]
    return list(ast.iter_child_nodes(node))


def places(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes that a fault may change."""
    if not is_told(node):
        yield node
        for part in parts(node):
            yield from places(part)


def faults(node: ast.AST) -> Iterator[tuple[ast.expr, str]]:
    """The changes of one node: the expression that is replaced, and by what."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in COMPARED:
        yield node, ast.unparse(ast.Compare(node.left, [COMPARED[type(node.ops[0])]()], node.comparators))
    if isinstance(node, ast.BinOp) and type(node.op) in SWAPPED:
        yield node, ast.unparse(ast.BinOp(node.left, SWAPPED[type(node.op)](), node.right))
    if isinstance(node, ast.BoolOp):
        yield node, ast.unparse(ast.BoolOp(SWAPPED[type(node.op)](), node.values))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub | ast.Invert):
        yield node, ast.unparse(node.operand)
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        yield node, repr(node.value + 1 if isinstance(node.value, int) else 1.5 * node.value or 0.5)
    if isinstance(node, ast.If):
        yield node.test, f"not ({ast.unparse(node.test)})"
    if isinstance(node, ast.Return) and node.value is not None and isinstance(node.value, ast.Call):
        yield from [(node.value, ast.unparse(node.value.args[0]))] if len(node.value.args) == 1 else []


def all_faults() -> list[tuple[Path, ast.expr, str]]:
    """Every fault that can be put in, by file, the expression and its replacement."""
    found = []
    for room in ROOMS:
        for path in sorted((ROOT / "simplexmesh" / room).rglob("*.py")):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            seen: set[tuple[int, int, str]] = set()
            for node in places(tree):
                for old, new in faults(node):
                    key = old.lineno, old.col_offset, new
                    if key not in seen:
                        seen.add(key)
                        found.append((path.relative_to(ROOT), old, new))
    return found


def replaced(text: str, old: ast.expr, new: str) -> str:
    """The text with one expression, given by its place, replaced; columns of `ast` count bytes."""
    lines = text.encode().splitlines(keepends=True)
    before = b"".join(lines[: old.lineno - 1]) + lines[old.lineno - 1][: old.col_offset]
    after = lines[old.end_lineno - 1][old.end_col_offset :] + b"".join(lines[old.end_lineno :])
    return (before + f"({new})".encode() + after).decode()


def names_around(tree: ast.AST, line: int) -> set[str]:
    """The functions and classes that a line is in."""
    kinds = ast.FunctionDef | ast.ClassDef
    return {node.name for node in ast.walk(tree) if isinstance(node, kinds) and node.lineno <= line <= node.end_lineno}


def nearest(copy: Path, path: Path, line: int) -> list[str]:
    """The test files that name the function or the module of a line; rare names and those of its folder count more."""
    files = [file for room in sorted(TESTED) for file in sorted((copy / room).rglob("test_*.py"))]
    score = dict.fromkeys(files, 0.0)
    for name in {*names_around(ast.parse((copy / path).read_text(encoding="utf-8")), line), path.stem}:
        named = [file for file in files if re.search(rf"(?<![A-Za-z0-9]){name}\b", file.read_text(encoding="utf-8"))]
        for file in named:
            score[file] += (2 if file.parent == test_folder(copy, path) else 1) / len(named)
    ranked = sorted((file for file in files if score[file]), key=lambda file: -score[file])
    return [str(file.relative_to(copy)) for file in ranked[:NEAREST]]


def test_folder(copy: Path, path: Path) -> Path:
    """The folder of the tests of a file: that of the same name, or of the folder above."""
    wanted = Path(copy, "tests", path.parts[1].strip("_"), *path.parts[2:-1])
    return next(folder for folder in (wanted, *wanted.parents) if folder.exists())


def circles(copy: Path, path: Path, line: int) -> list[list[str]]:
    """The tests of a line, in the order they are tried."""
    module = ".".join(path.with_suffix("").parts)
    importing = [
        file.relative_to(copy)
        for file in sorted((copy / "simplexmesh").rglob("*.py"))
        if re.search(rf"\b{re.escape(module)}\b", file.read_text(encoding="utf-8"))
    ]
    folders = [test_folder(copy, each).relative_to(copy) for each in (path, *importing)]
    rooms = sorted({str(Path(*folder.parts[:2])) for folder in folders} & TESTED)
    own = [str(folders[0]), str(path.parent)]
    return [tests for tests in (nearest(copy, path, line), own, rooms) if tests]


def run_tests(copy: Path, tests: list[str], kernels: Path, limit: float) -> tuple[int | None, str]:
    """The exit code of some tests, None if they do not end in time, and the end of what they print."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n0", "-p", "no:cacheprovider", *tests]
    own = os.environ | {"PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(kernels)}
    try:
        done = subprocess.run(command, cwd=copy, env=own, capture_output=True, text=True, timeout=limit, check=False)
        return done.returncode, done.stdout[-2000:]
    except subprocess.TimeoutExpired:
        return None, f"they take over {limit:.0f} s"


def outcome(copy: Path, fault: tuple[Path, ast.expr, str], limit: float) -> str:
    """What becomes of a fault: tests near it fail, all pass, or some do not end in time."""
    path, old, new = fault
    file = copy / path
    sound, times = file.read_text(encoding="utf-8"), file.stat()
    tests = circles(copy, path, old.lineno)
    file.write_text(replaced(sound, old, new), encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        kernels = Path(folder, "kernels")  # what is compiled with the fault replaces nothing that is sound
        shutil.copytree(copy / KERNELS, kernels, copy_function=os.link)
        try:  # also where an import or the interpreter breaks
            for each in tests:
                code, _ = run_tests(copy, each, kernels, limit)
                if code != 0:
                    return ENDLESS if code is None else CAUGHT
            return SURVIVED
        finally:
            file.write_text(sound, encoding="utf-8")
            os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))  # else its kernels would be compiled anew


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=30, help="how many faults")
    parser.add_argument("--seed", type=int, default=0, help="which ones")
    parser.add_argument("--room", choices=ROOMS, help="in one room only")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds for the tests of a fault")
    asked = parser.parse_args()
    known = [fault for fault in all_faults() if asked.room in (None, fault[0].parts[1])]
    drawn = random.Random(asked.seed).sample(known, min(max(asked.count, 1), len(known)))
    counts = dict.fromkeys((CAUGHT, SURVIVED, ENDLESS), 0)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "copy")
        skipped = shutil.ignore_patterns(".git", ".venv", ".*_cache", ".hypothesis", "demo_output", "_build")
        shutil.copytree(ROOT, copy, ignore=skipped)
        (copy / KERNELS).mkdir()
        tests = {test for path, old, _ in drawn for circle in circles(copy, path, old.lineno) for test in circle}
        code, said = run_tests(copy, sorted(tests), copy / KERNELS, len(drawn) * asked.limit)
        if code != 0:
            sys.exit(f"the tests fail without any fault: {said}")
        for number, (path, old, new) in enumerate(drawn, 1):
            found = outcome(copy, (path, old, new), asked.limit)
            counts[found] += 1
            told = f"{path}:{old.lineno}: {ast.unparse(old)} -> {new}"
            print(f"{number}/{len(drawn)} {found:8} {told}", flush=True)  # noqa: T201
    share = counts[CAUGHT] / max(len(drawn) - counts[ENDLESS], 1)
    ended = f"{share:.0%} of {len(drawn) - counts[ENDLESS]} faults caught with which tests end"
    print(f"{ended}, {counts[ENDLESS]} do not end, of {len(known):,} possible ones")  # noqa: T201
    return 0 if share >= AT_LEAST else 1


if __name__ == "__main__":
    sys.exit(main())
