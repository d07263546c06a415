"""The command line: `simplexmesh demo | reconstruct | decimate | register | curvature | library | info | view`.

Nothing heavy is imported before a command runs, so that `--help` is immediate.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command and leave with its code: 0 done, 2 bad input, 1 diverged, 130 interrupted."""
    try:
        from simplexmesh.cli.app import run

        code = run(arguments)
    except KeyboardInterrupt:  # while this was still being imported
        sys.stderr.write("error: interrupted; nothing was written\n")
        code = 130
    sys.exit(code)
