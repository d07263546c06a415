"""Occlusion of two rows of teeth, as in the planning of jaw surgery.

Left: the lower row in its initial pose, rotated, displaced and too low. Right: the pose found by `occlude`, seen from
above with the upper row removed, colored by the distance between them, small where they touch.
"""

import numpy as np

import simplexmesh as sm

AWAY = np.array([0.35, -0.15, -0.7])
TURNED = np.radians([3.0, -4.0, 5.0])


def main(size="large"):
    """Bring a lower row into occlusion with an upper one; return both, the motion, and its error."""
    count = 120 if size == "large" else 50
    upper, lower = row(count, play=0.2), row(count)
    upper = sm.TriangleMesh(upper.vertices, upper.faces[:, ::-1])  # facing down
    initial = lower.transformed(motion())
    found = sm.occlude(initial, upper, tolerance=0.03, reach=1.0)
    placed = initial.transformed(found.T_target_source)
    return {
        "upper": upper,
        "initial": initial,
        "placed": placed,
        "found": found,
        "touching": found.contact_area / lower.area,
        "error": float(np.linalg.norm(placed.vertices - lower.vertices, axis=1).max()),
    }


def row(count, play=0.0):
    """Return the occlusal surfaces of a row of molars with four cusps each, lifted unevenly by some play."""
    sheet = sm.plane(3 * count, count, size=(9.0, 3.0)).triangulated("dual")
    x, y, _ = sheet.vertices.T
    tooth = (x + 4.5) % 3 - 1.5  # relative to the center of the tooth
    z = np.full(len(x), -0.6)
    for k, (a, b) in enumerate([(-0.7, -0.6), (0.7, -0.65), (-0.65, 0.6), (0.7, 0.7)]):
        z += (1.0 + 0.1 * k) * np.exp(-((tooth - a) ** 2 + (y - b) ** 2) / 0.25)
    z -= 0.5 * np.exp(-(((np.abs(tooth) - 1.5) / 0.12) ** 2))  # between teeth
    z += 0.05 * np.sin(1.7 * x) * np.cos(2 * y)
    z += play * np.sin(1.3 * x + 1) ** 2 * np.cos(0.9 * y) ** 2
    return sm.TriangleMesh(np.stack([x, y + 0.06 * x**2, z], axis=1), sheet.faces)


def motion():
    """Return the initial pose of the lower row: a small rotation and a translation."""
    angle = np.linalg.norm(TURNED)
    x, y, z = TURNED / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    T = np.eye(4)
    T[:3, :3] += np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    T[:3, 3] = AWAY
    return T


def show(out):
    """Draw the rows before, and the distance between them after."""
    plotter = sm.plot.stage(columns=2)
    lifted = sm.TriangleMesh(out["upper"].vertices + np.array([0, 0, 1.2]), out["upper"].faces)
    sm.plot.surface(lifted, plotter=plotter, color="#4878a8")
    sm.plot.surface(out["initial"], plotter=plotter, color="#d9cfc0")
    plotter.subplot(0, 1)
    sm.plot.heat(
        out["placed"], out["found"].distances, name="distance to the upper row", limits=(0, 0.2), plotter=plotter
    )
    return sm.plot.looked_at(plotter, (0.25, -1.0, 0.9))


if __name__ == "__main__":
    show(main()).show()
