"""Pipes and walls of a scanned plant.

A pipe with two bends, a thinner one, a tank and a floor are scanned, with noise and stray points. Nothing is told:
`extract_primitives` names every surface, `extract_pipes` puts those of pipes in their order, tangent to each other.
"""

import numpy as np

import simplexmesh as sm

NOISE, STRAY = 0.002, 0.05  # in meters, and as a share of the points
CORNERS = np.array([[-1.2, 0.0, 0.4], [0.6, 0.0, 0.4], [0.6, 0.0, 1.5], [0.6, 1.3, 1.9]])
RADIUS, BEND = 0.07, 0.22


def main(size="large"):
    """Return the scan, its primitives and its pipes."""
    points = scan(60_000 if size == "large" else 10_000)
    return {"points": points, "scene": sm.extract_primitives(points), "plant": sm.extract_pipes(points)}


def scan(count, seed=0):
    """Return points of the plant with noise along the normals, and stray ones."""
    rng = np.random.default_rng(seed)
    p = sm.primitives
    turn = [-np.pi, np.pi]
    shapes = [*line(), ended(p.Cylinder([-1.1, 0.9, 0.0], [0, 0, 1], 0.035), [turn, [0.05, 1.8]])]
    shapes += [ended(p.Cylinder([-0.4, 1.1, 0.0], [0, 0, 1], 0.3), [turn, [0.1, 0.9]])]
    shapes += [ended(p.Sphere([-0.4, 1.1, 0.9], 0.3), [turn, [0, np.pi / 2]])]
    shapes += [ended(p.Plane([0, 0.5, 0], [0, 0, 1]), [[-1.4, 1.4], [-1.2, 1.2]])]
    areas = np.array([shape.triangulated().area for shape in shapes])
    found = []
    for shape, share in zip(shapes, np.sqrt(areas) / np.sqrt(areas).sum(), strict=True):
        on = shape.sampled(int(share * count), rng=rng).points
        found.append(on + NOISE * rng.normal(size=(len(on), 1)) * shape.gradient(on))
    points = np.concatenate(found)
    return np.concatenate([points, rng.uniform(points.min(axis=0), points.max(axis=0), (int(STRAY * count), 3))])


def line():
    """Return the cylinders and bends of a pipe along the corners."""
    p, out, start = sm.primitives, [], CORNERS[0]
    for before, corner, after in zip(CORNERS, CORNERS[1:], CORNERS[2:], strict=False):
        one, two = (each / np.linalg.norm(each) for each in (corner - before, after - corner))
        angle = np.arccos(one @ two)
        reach = BEND * np.tan(angle / 2)
        out.append(straight(start, corner - reach * one))
        center = corner + BEND / np.sin(angle) * (two - one)
        torus = p.Torus(center, np.cross(one, two), BEND, RADIUS)
        first, last = torus.coordinates([corner - reach * one, corner + reach * two])[:, 0]
        out.append(ended(torus, [[first, first + np.mod(last - first, 2 * np.pi)], [-np.pi, np.pi]]))
        start = corner + reach * two
    return [*out, straight(start, CORNERS[-1])]


def straight(start, end):
    """Return the cylinder from one point to another."""
    return ended(
        sm.primitives.Cylinder(start, end - start, RADIUS), [[-np.pi, np.pi], [0, np.linalg.norm(end - start)]]
    )


def ended(primitive, extent):
    """Return a primitive with ends."""
    p = primitive.n_parameters
    return primitive.with_fit(sm.primitives.Fit(0.0, 0.0, np.zeros((p, p)), np.array(extent, float), 0))


def show(out):
    """Draw the primitives, and the pipes."""
    plotter = sm.plot.stage(columns=2)
    kinds = f"{len(out['scene'].primitives)} primitives"
    sm.plot.primitives(out["points"], out["scene"], title=kinds, plotter=plotter)
    plotter.subplot(0, 1)
    pipes = f"{len(out['plant'].lines)} pipe lines"
    sm.plot.primitives(out["points"], out["plant"], title=pipes, plotter=plotter)
    return sm.plot.looked_at(plotter, (-0.5, -1.0, 0.6))


if __name__ == "__main__":
    result = main()
    print(*result["scene"].primitives, *result["plant"].lines, sep="\n")
    show(result).show()
