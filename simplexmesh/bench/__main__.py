"""`python -m simplexmesh.bench`: write a report that compares all estimators."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence

from simplexmesh._base.interrupts import deferred_interrupts

PRINTINGS = ("article", "thesis")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the report and return the exit code: 0, 2 on bad input, 130 when interrupted."""
    parser = argparse.ArgumentParser(
        prog="python -m simplexmesh.bench",
        description="Compare all estimators of normals and curvatures on surfaces with known values.",
        epilog="Example: python -m simplexmesh.bench --methods sine,quadric,area --quick -o report/",
    )
    parser.add_argument("--surfaces", default="all", help="all, or names separated by commas, such as cubic,sphere")
    parser.add_argument("--methods", default="all", help="all, or names of sm.curvature and sm.vertex_normals")
    parser.add_argument("--printing", default="article", choices=PRINTINGS, help="source of the test functions")
    parser.add_argument("--quick", action="store_true", help="smaller meshes and fewer pictures, about ten seconds")
    parser.add_argument("--output", "-o", required=True, help="folder to write, a new one")
    given = parser.parse_args(arguments)
    start = time.perf_counter()
    try:  # imported here, so that an interrupt meanwhile is reported like any other
        from simplexmesh.bench import report, run
        from simplexmesh.bench.trials import candidates
        from simplexmesh.bench.truth import graphs

        known = graphs.PRINTINGS[given.printing]
        surfaces = [known[name] for name in candidates.chosen("surfaces", given.surfaces, list(known))]
        names = candidates.named(given.methods)
        folder = report.writable(given.output)
        with deferred_interrupts() as interrupts, report.draft_of(folder) as draft:
            shown = interrupts.checking(_show)
            found = run.measured(surfaces, names, shown, quick=given.quick)
            run.write(found, draft, shown, quick=given.quick)
            interrupts.check()
    except (ValueError, OSError) as problem:
        return _ended(2, f"error: {problem}")
    except KeyboardInterrupt:
        return _ended(130, "interrupted, nothing was written")
    many, seconds = sum(len(methods) for methods in names.values()), time.perf_counter() - start
    _ended(0, "")
    sys.stdout.write(f"{given.output}: {many} methods, {seconds:.0f} s; see {folder / report.INDEX}\n")
    return 0


def _show(share: float, what: str) -> None:
    """Show the progress on the error stream, on one line, if that is a terminal."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\x1b[K{100 * share:3.0f} %  {what}")
        sys.stderr.flush()


def _ended(code: int, message: str) -> int:
    """Clear the line of the progress, print a message, and return the code."""
    sys.stderr.write(("\r\x1b[K" if sys.stderr.isatty() else "") + (message and message + "\n"))
    return code


if __name__ == "__main__":
    sys.exit(main())
