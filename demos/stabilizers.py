"""What smooth means: one closed curve through six points, by three stabilizers.

The thin rod, a linear spline of Tikhonov's kind, depends on how the points are numbered and shrinks circles. Intrinsic
polynomial stabilizers (IPS) smooth the turns of the curve: curvature is piecewise linear with order two, smoother with
order three, and circles are at rest. The teeth show curvature; thinner is the curve that springs draw to the points.
"""

import numpy as np
import pyvista as pv
from scipy.optimize import least_squares

import simplexmesh as sm

POINTS = np.array([[1.0, 0.0], [0.35, 0.75], [-0.5, 0.95], [-0.45, 0.1], [-0.9, -0.7], [0.4, -0.6]])
SPRING = 0.005  # share of the way to its point that a vertex is drawn
SHOWN = {"thin rod": ("rod", 2), "IPS of order two": ("ips", 2), "IPS of order three": ("ips", 3)}


def main(size="large"):
    """Return the curves, how far their curvature is from linear between the points, and circles after 200 steps."""
    between = 12 if size == "large" else 8
    whole = np.concatenate([POINTS, POINTS[:1]])
    at = np.arange(len(POINTS) * between) / between
    start = np.stack([np.interp(at, np.arange(7), whole[:, k]) for k in range(2)], axis=1)
    curves, bends = {}, {}
    for name, (kind, order) in SHOWN.items():
        force = STABILIZERS[kind, order]
        first = curves.get("IPS of order two", curves.get("thin rod", (start,)))[0]
        pinned = solved(force, first, between, pinned=True)
        curves[name] = pinned, solved(force, pinned, between, pinned=False)
        curvature = turns(curves[name][0])
        second = np.abs(np.diff(curvature.reshape(-1, between)[:, 1:], n=2, axis=1))
        bends[name] = float(second.max() / np.ptp(curvature))
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    radii = {}
    for (kind, order), force in STABILIZERS.items():
        circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        for _ in range(200):
            circle += 0.5 * force(circle)
        radii[f"{kind} {order}"] = float(np.linalg.norm(circle, axis=1).mean())
    return {"curves": curves, "bends": bends, "radii": radii}


def difference(values):
    """Return the second difference of values around a closed curve."""
    return np.roll(values, 1, axis=0) - 2 * values + np.roll(values, -1, axis=0)


def mean(values):
    """Return the mean of each value and its neighbors."""
    return values + difference(values) / 3


def turns(curve):
    """Return the angle by which the curve turns at each vertex."""
    ahead = np.roll(curve, -1, axis=0) - curve
    back = np.roll(ahead, 1, axis=0)
    return np.arctan2(back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0], (back * ahead).sum(axis=1))


def ips(curve, goal):
    """Return the displacement of each vertex to where the curve turns by the goals, between its neighbors."""
    chord = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    return difference(curve) / 2 - np.tan(goal / 2)[:, None] * chord @ [[0, 1], [-1, 0]] / 2


STABILIZERS = {
    ("rod", 1): lambda v: difference(v) / 2,
    ("rod", 2): lambda v: -difference(difference(v)) / 16,
    ("ips", 0): lambda v: ips(v, turns(v)),
    ("ips", 1): lambda v: ips(v, 0 * turns(v)),
    ("ips", 2): lambda v: ips(v, mean(turns(v))),
    ("ips", 3): lambda v: ips(v, turns(v) + (difference(turns(v)) - mean(difference(turns(v)))) / 3),
}
"""By kind and order: what each adds to a closed curve (n, 2)."""


def solved(force, start, between, *, pinned):
    """Return the curve at rest under a stabilizer, every so manieth vertex at its point, or drawn to it."""
    free = np.ones(len(start), bool)
    free[::between] = not pinned

    def rest(unknown):
        curve = start.copy()
        curve[free] = unknown.reshape(-1, 2)
        out = force(curve)
        out[::between] += SPRING * (POINTS - curve[::between])
        return out[free].ravel()

    out = start.copy()
    out[free] = least_squares(rest, start[free].ravel(), xtol=1e-10).x.reshape(-1, 2)
    return out


def show(out):
    """Draw each curve with its curvature, and the one drawn by springs."""
    plotter = sm.plot.stage(columns=3)
    for k, (name, (curve, loose)) in enumerate(out["curves"].items()):
        plotter.subplot(0, k)
        around = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
        inward = around @ [[0, 1], [-1, 0]] / (around**2).sum(axis=1, keepdims=True)
        teeth = curve - 0.1 * 4 * turns(curve)[:, None] * inward / 2
        flat = [np.column_stack([line, 0 * line[:, 0]]) for line in (curve, loose, teeth)]
        comb = pv.line_segments_from_points(np.stack([flat[0], flat[2]], axis=1).reshape(-1, 3))
        plotter.add_mesh(comb, color="#7fa6c9", line_width=1)
        for line, color, width in zip(flat, ("#22303c", "#c23b22", "#7fa6c9"), (5, 2, 2), strict=True):
            plotter.add_mesh(pv.lines_from_points(line, close=True), color=color, line_width=width)
        plotter.add_mesh(pv.PolyData(np.column_stack([POINTS, 0 * POINTS[:, 0]])), color="#22303c", point_size=12)
        plotter.add_text(name, font_size=12, position="upper_edge", color="#22303c")
    return sm.plot.looked_at(plotter, (0.0, 0.0, 1.0), up="y")


if __name__ == "__main__":
    show(main()).show()
