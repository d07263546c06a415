"""`python -m simplexmesh` is the command simplexmesh."""

from simplexmesh.cli import main

if __name__ == "__main__":
    main()
