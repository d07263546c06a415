"""Organs of a frog from a labelled volume, then one of them again from a noisy scan."""

from simplexmesh.cli.frog import main, show, show_scan

__all__ = ["main", "show", "show_scan"]

if __name__ == "__main__":
    show(main()).show()
