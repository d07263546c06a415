"""Smoothing a dented sphere.

Only the internal force acts: every vertex moves to where its mean curvature is the average over its neighborhood. The
result is a sphere, which no part of the method prescribes.
"""

import numpy as np

import simplexmesh as sm

SHOWN = (0, 20, 100)


def main(size="large"):
    """Dent a sphere, let it relax, and return meshes and sphericity on the way."""
    ball = sm.sphere(12 if size == "large" else 6)
    cosine = ball.vertices @ np.array([0.6, -0.6, np.sqrt(0.28)])  # of the angle from the dent
    dented = ball.moved(ball.vertices * (1 - 0.6 * np.exp(-8 * (1 - cosine)))[:, None])
    iterations = 2000 if size == "large" else 400
    shown = {"dented": dented}
    model = sm.DeformableModel(dented, rigidity=6)
    for state in model.run(iterations):
        if state.iteration in SHOWN:
            shown[f"after {state.iteration} iterations"] = model.mesh
    shown[f"after {iterations}"] = model.mesh
    return {"meshes": shown, "sphericity": [sphericity(mesh) for mesh in shown.values()]}


def sphericity(mesh):
    """Return 36 π V² / A³: 1 for a sphere, less for anything else."""
    return 36 * np.pi * mesh.volume**2 / mesh.area**3


def show(out):
    """Draw the states in panels, colored by curvature."""
    return sm.plot.panels(out["meshes"], view=(0.6, -1.0, 0.4), scalars="sphere_curvature", limits=(-2, 2))


if __name__ == "__main__":
    show(main()).show()
