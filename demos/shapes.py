"""Built-in shapes.

Every vertex has three neighbors, so faces are mostly hexagons; the sphere has twelve pentagons. The cylinder and the
plane have holes, the torus has a handle.
"""

import simplexmesh as sm


def main(size="large"):
    """Make each shape; return its genus and its numbers of holes and of defects."""
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
    """Draw the shapes in panels."""
    return sm.plot.panels({f"{name}, {mesh.n_vertices:,}": mesh for name, mesh in out["shapes"].items()})


if __name__ == "__main__":
    show(main()).show()
