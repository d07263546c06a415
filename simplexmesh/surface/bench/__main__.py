"""`python -m simplexmesh.surface.bench`: write a report that compares all estimators."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence

from simplexmesh._interrupts import resend_lost_interrupts

INTERRUPTED = 130
PRINTINGS = ("article", "thesis")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the report and return the exit code: 0, 2 on bad input, 130 when interrupted."""
    parser = argparse.ArgumentParser(
        prog="python -m simplexmesh.surface.bench",
        description="Compare all estimators of normals and curvatures on surfaces with known values.",
        epilog="Example: python -m simplexmesh.surface.bench --methods sine,quadric,area --quick -o report/",
    )
    parser.add_argument("--surfaces", default="all", help="all, or names separated by commas, such as cubic,sphere")
    parser.add_argument("--methods", default="all", help="all, or names of sm.curvature and sm.vertex_normals")
    parser.add_argument("--printing", default="article", choices=PRINTINGS, help="source of the test functions")
    parser.add_argument("--quick", action="store_true", help="smaller meshes and fewer pictures, about ten seconds")
    parser.add_argument("--output", "-o", required=True, help="folder to write: new, empty, or an earlier report")
    given = parser.parse_args(arguments)
    start = time.perf_counter()
    try:  # imported here, so that an interrupt meanwhile is reported like any other
        from simplexmesh.surface.bench import candidates, report, run
        from simplexmesh.surface.truth import graphs

        known = graphs.PRINTINGS[given.printing]
        surfaces = [known[name] for name in candidates.chosen("surfaces", given.surfaces, list(known))]
        names = candidates.named(given.methods)
        folder = report.writable(given.output)
        with resend_lost_interrupts(), report.draft_of(folder) as draft:
            found = run.measured(surfaces, names, progress, quick=given.quick)
            run.write(found, draft, progress, quick=given.quick)
    except (ValueError, OSError) as problem:
        progress.clear()
        sys.stderr.write(f"error: {problem}\n")
        return 2
    except KeyboardInterrupt:
        progress.clear()
        sys.stderr.write("interrupted, nothing was written\n")
        return INTERRUPTED
    progress.clear()
    many = sum(len(methods) for methods in names.values())
    sys.stdout.write(
        f"{given.output}: {many} methods, {time.perf_counter() - start:.0f} s; see {folder / report.INDEX}\n"
    )
    return 0


class _Progress:
    """Progress on the error stream, on one line, if that is a terminal."""

    def __call__(self, share: float, what: str) -> None:
        if sys.stderr.isatty():
            sys.stderr.write(f"\r\x1b[K{100 * share:3.0f} %  {what}")
            sys.stderr.flush()

    def clear(self) -> None:
        if sys.stderr.isatty():
            sys.stderr.write("\r\x1b[K")


progress = _Progress()

if __name__ == "__main__":
    sys.exit(main())
