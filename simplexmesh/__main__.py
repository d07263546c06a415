"""`python -m simplexmesh` is the command simplexmesh."""

import sys

from simplexmesh.cli import main

if __name__ == "__main__":
    sys.exit(main())
