"""Shapes to start from.

Every vertex has three neighbors, so faces are mostly hexagons; the sphere has twelve pentagons. Tube and sheet have
holes, the torus a handle.
"""

import simplexmesh as sm


def main(size="large"):
    """Make each shape, and say its genus, its holes and what is wrong with it."""
    vertices = 1200 if size == "large" else 200
    shapes = {
        "sphere": sm.sphere(vertices=vertices),
        "ellipsoid": sm.ellipsoid((1.4, 1.0, 0.7), vertices=vertices),
        "cylinder": sm.cylinder(vertices=vertices),
        "plane": sm.plane(vertices=vertices, size=(2, 2)),
        "torus": sm.torus(vertices=vertices),
    }
    numbers = {name: (mesh.genus, mesh.n_holes, len(mesh.check().problems)) for name, mesh in shapes.items()}
    return {"shapes": shapes, "numbers": numbers}


def show(out):
    """Draw them next to each other."""
    return sm.plot.panels({f"{name}, {mesh.n_vertices:,}": mesh for name, mesh in out["shapes"].items()})


if __name__ == "__main__":
    show(main()).show()
