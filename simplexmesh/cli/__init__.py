"""The command line: `simplexmesh demo | reconstruct | info | view`.

Nothing heavy is imported before a command runs, so that `--help` is immediate.
"""

from simplexmesh.cli.app import main

__all__ = ["main"]
