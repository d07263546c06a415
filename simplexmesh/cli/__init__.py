"""The command line; heavy modules are imported when a command runs, so that `--help` is immediate."""

from __future__ import annotations

import sys
from collections.abc import Sequence

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command and exit with its code: 0 success, 2 invalid input, 1 diverged, 130 interrupted."""
    try:
        from simplexmesh.cli.app import run

        code = run(arguments)
    except KeyboardInterrupt:  # during the import
        sys.stderr.write("error: interrupted; nothing was written\n")
        code = 130
    sys.exit(code)
