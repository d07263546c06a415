"""Curvature of the sphere through a vertex and its neighbors.

It is the mean curvature on a sphere, for any distribution of its vertices, and of second order in the spacing on
regular hexagons, as of a cylinder. On other meshes it is not: there `mean_curvature` is right. The picture shows that
of a sphere with bumps.
"""

import numpy as np

import simplexmesh as sm


def main(size="large"):
    """Return the largest relative errors on a sphere with irregular vertices, and on finer and finer cylinders."""
    ball = sm.sphere(20)
    scattered = ball.vertices + 0.002 * np.random.default_rng(0).normal(size=ball.vertices.shape)
    ball = ball.moved(scattered / np.linalg.norm(scattered, axis=1, keepdims=True))
    around = (12, 24, 48, 96) if size == "large" else (12, 24)
    return {
        "sphere": float(np.abs(ball.sphere_curvature - 1).max()),
        "cylinders": [cylinder_error(n) for n in around],
        "bumpy": bumpy(24 if size == "large" else 8),
    }


def cylinder_error(around):
    """Return the largest relative error on a cylinder of radius 1 and regular hexagons, away from its ends."""
    tube = sm.cylinder(around, 2 * around, height=2 * np.pi * np.sqrt(3))
    middle = np.abs(tube.vertices[:, 2]) < 2
    return float(np.abs(tube.sphere_curvature[middle] - 0.5).max() / 0.5)


def bumpy(frequency):
    """Return a sphere with bumps and hollows."""
    ball = sm.sphere(frequency)
    return ball.moved(ball.vertices * (1 + 0.25 * np.prod(np.sin(4 * ball.vertices), axis=1, keepdims=True)))


def show(out):
    """Color the sphere by its mean curvature."""
    return sm.plot.surface(out["bumpy"], scalars="mean_curvature")


if __name__ == "__main__":
    show(main()).show()
