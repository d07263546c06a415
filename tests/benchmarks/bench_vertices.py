"""Mean distance from organs of a frog to models of more and more vertices: the table of `docs/howto/vertices.md`.

Run as `python tests/benchmarks/bench_vertices.py`; it takes a quarter of an hour of processor time. The least and most
of three runs, with as many vertices and with one in a hundred less and more.
"""

from __future__ import annotations

import warnings

import numpy as np
from pyvista import examples

import simplexmesh as sm

ORGANS = {"liver": 10, "lungs": 11, "brain": 2, "skeleton": 13}
SIZES = 500, 1000, 2000, 4000, 8000, 16_000, 32_000


def shown(name, vertices):
    """Return a cell: nothing where the organ is too fine for so few vertices, or too coarse for so many."""
    if not (vertices >= 4000 if name == "skeleton" else vertices <= 16_000):
        return ""
    frog, counts = examples.load_frog_tissues(), (vertices * np.array([0.99, 1, 1.01])).astype(int).tolist()
    models = [sm.reconstruct(frog, label=ORGANS[name], vertices=count) for count in counts]
    means = [model.distance.data_to_mesh.mean for model in models]
    return " to ".join(dict.fromkeys(f"{each:.2g}" for each in (min(means), max(means))))


def main():
    print("| vertices |", " | ".join(ORGANS), "|")
    for vertices in SIZES:
        print(f"| {vertices:,} |", " | ".join(shown(name, vertices) for name in ORGANS), "|", flush=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore", sm.SimplexMeshWarning)  # of pieces left out
    main()
