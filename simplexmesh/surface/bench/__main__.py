"""`python -m simplexmesh.surface.bench`: the comparison of all estimators, as a report."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence

from simplexmesh._interrupts import resend_lost_interrupts

INTERRUPTED = 130
PRINTINGS = ("article", "thesis")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the report and return the exit code: 0, 2 after one sentence on bad input, 130 when interrupted."""
    parser = argparse.ArgumentParser(
        prog="python -m simplexmesh.surface.bench",
        description="Compare all estimators of normals and curvatures on surfaces that are known.",
        epilog="Example: python -m simplexmesh.surface.bench --methods sine,quadric,area --quick -o report/",
    )
    parser.add_argument("--surfaces", default="all", help="all, or names with commas between, such as cubic,sphere")
    parser.add_argument("--methods", default="all", help="all, or names of sm.curvature and sm.vertex_normals")
    parser.add_argument("--printing", default="article", choices=PRINTINGS, help="whose test functions")
    parser.add_argument("--quick", action="store_true", help="smaller meshes, fewer pictures: some ten seconds")
    parser.add_argument("--output", "-o", required=True, help="folder to write: new, empty, or an earlier report")
    given = parser.parse_args(arguments)
    began = time.perf_counter()
    try:  # imported here, so that an interrupt meanwhile is told like any other
        from simplexmesh.surface.bench import candidates, report, run
        from simplexmesh.surface.truth import graphs

        known = graphs.PRINTINGS[given.printing]
        surfaces = [known[name] for name in candidates.chosen("surfaces", given.surfaces, list(known))]
        names = candidates.named(given.methods)
        folder = report.writable(given.output)
        with resend_lost_interrupts(), report.draft_of(folder) as draft:
            found = run.measured(surfaces, names, told, quick=given.quick)
            run.written(found, draft, told, quick=given.quick)
    except (ValueError, OSError) as problem:
        told.clear()
        sys.stderr.write(f"error: {problem}\n")
        return 2
    except KeyboardInterrupt:
        told.clear()
        sys.stderr.write("interrupted, nothing was written\n")
        return INTERRUPTED
    told.clear()
    many = sum(len(methods) for methods in names.values())
    sys.stdout.write(
        f"{given.output}: {many} methods, {time.perf_counter() - began:.0f} s; see {folder / report.INDEX}\n"
    )
    return 0


class _Told:
    """Progress on the error stream, one line that is written over, where somebody watches."""

    def __call__(self, share: float, what: str) -> None:
        if sys.stderr.isatty():
            sys.stderr.write(f"\r\x1b[K{100 * share:3.0f} %  {what}")
            sys.stderr.flush()

    def clear(self) -> None:
        if sys.stderr.isatty():
            sys.stderr.write("\r\x1b[K")


told = _Told()

if __name__ == "__main__":
    sys.exit(main())
