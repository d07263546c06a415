"""A dented sphere becomes round.

Nothing draws it but itself: every vertex moves to where the mean curvature is that of its neighborhood.
The sphere needs to be told nothing of spheres.
"""

import numpy as np

import simplexmesh as sm

SHOWN = (0, 20, 100)


def main(size="large"):
    """Push a dent into a sphere, let it go, and say how round it is on the way."""
    ball = sm.sphere(12 if size == "large" else 6)
    towards = ball.vertices @ np.array([0.6, -0.6, np.sqrt(0.28)])
    dented = ball.moved(ball.vertices * (1 - 0.6 * np.exp(-8 * (1 - towards)))[:, None])
    iterations = 2000 if size == "large" else 400
    shown = {"dented": dented}
    model = sm.DeformableModel(dented, rigidity=6)
    for state in model.run(iterations):
        if state.iteration in SHOWN:
            shown[f"after {state.iteration} iterations"] = model.mesh
    shown[f"after {iterations}"] = model.mesh
    return {"meshes": shown, "roundness": [roundness(mesh) for mesh in shown.values()]}


def roundness(mesh):
    """Return 36 π V² / A³: 1 for a sphere, less for anything else."""
    return 36 * np.pi * mesh.volume**2 / mesh.area**3


def show(out):
    """Draw the states next to each other, colored by curvature."""
    return sm.plot.panels(out["meshes"], view=(0.6, -1.0, 0.4), scalars="mean_curvature", limits=(-2, 2))


if __name__ == "__main__":
    show(main()).show()
