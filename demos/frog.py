"""Organs of a frog from a label map.

Twelve organs are reconstructed from a labeled magnetic resonance volume, with the topology each has; then the liver
again from a simulated noisy scan. The command `simplexmesh demo` does the same and writes models, report and pictures.
"""

from simplexmesh.cli.frog import main, show, show_scan

__all__ = ["main", "show", "show_scan"]

if __name__ == "__main__":
    show(main()).show()
