"""The recognition done plainly: every rotation, every vertex, and the thesis's first method of two scales."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.recognition.sai.sphere_domain import sphere_domain


def angles_between(first, second):
    """The angles (k, m) between rotations (k, 3, 3) and (m, 3, 3), in radians."""
    return np.arccos(np.clip((np.einsum("kab,mab->km", first, second) - 1) / 2, -1, 1))


def all_images(table):
    """The vertex nearest to the image of each vertex under each rotation of a table, (60 m, n)."""
    return np.moveaxis(table.turns[:, table.maps], 0, 1).reshape(len(table), -1)


def search(table, first, second):
    """Equation 6.4: the sum over l of (first[R_j(l)] - second[l])^2, for each row of a table of indices."""
    return np.array([((first[row] - second) ** 2).sum() for row in table])


def search_seen(table, first, first_seen, second, second_seen):
    """The same over the vertices seen in both, and how many they are."""
    total, common = np.zeros(len(table)), np.zeros(len(table))
    for j, row in enumerate(table):
        both = first_seen[row] & second_seen
        total[j], common[j] = ((first[row] - second)[both] ** 2).sum(), both.sum()
    return total, common


def interpolated(frequency, values, direction):
    """The value at a unit vector, linear in a triangle of a vertex and two of its faces' centers."""
    here = sphere_domain(frequency)
    means = np.array([values[loop].mean() for loop in here.mesh.faces])
    for i in np.argsort(-(here.vertices @ direction))[:12]:
        for j in range(3):
            f, g = here.mesh.connectivity.face[i, j - 1], here.mesh.connectivity.face[i, j]
            corners = np.stack([here.vertices[i], here.centers[f], here.centers[g]], axis=1)
            weights = np.linalg.solve(corners, direction)
            if weights.min() >= -1e-9:
                return weights @ [values[i], means[f], means[g]] / weights.sum()
    raise AssertionError("no triangle holds the direction")


def zxz(alpha, beta, gamma):
    """The rotation of figure 6.8: about z, about x, about the new z."""

    def about(axis, angle):
        c, s = np.cos(angle), np.sin(angle)
        return (
            np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
            if axis == "x"
            else np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        )

    return about("z", alpha) @ about("x", beta) @ about("z", gamma)


def distance(frequency, first, second, R):
    """Equation 6.3 over n: the mean square of first(R P) - second(P)."""
    here = sphere_domain(frequency)
    return ((here.interpolated(first, here.locate(here.vertices @ R.T)) - second) ** 2).mean()


def two_scales(frequency, first, second, *, coarse=10.0, fine=1.0, reach=8.0):
    """The thesis's first method: all of z-x-z in steps of 10 degrees, then steps of 1 degree around the minimum."""
    around = np.radians(np.arange(0, 360, coarse))
    best, at = np.inf, None
    vertices = sphere_domain(frequency).vertices
    tree = cKDTree(vertices)
    for alpha in around:
        for beta in np.radians(np.arange(0, 180 + coarse, coarse)):
            turns = np.stack([zxz(alpha, beta, gamma) for gamma in around])
            images = np.einsum("kab,nb->kna", turns, vertices).reshape(-1, 3)
            rows = tree.query(images)[1].reshape(len(turns), -1)
            sums = ((first[rows] - second) ** 2).sum(axis=1)
            if sums.min() < best:
                best, at = sums.min(), (alpha, beta, around[sums.argmin()])
    steps = np.radians(np.arange(-reach, reach + fine, 2 * fine))
    near = [(a, b, c) for a in at[0] + steps for b in at[1] + steps for c in at[2] + steps]
    values = [distance(frequency, first, second, zxz(*angles)) for angles in near]
    return zxz(*near[int(np.argmin(values))])


def angle(A, B):
    """Degrees between two rotations."""
    return float(np.degrees(np.arccos(np.clip((np.trace(A @ B.T) - 1) / 2, -1, 1))))


def random_rotation(rng):
    """A rotation drawn evenly."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def lumpy(frequency=14, seed=0, lumps=6):
    """A closed body without symmetry: a sphere with bumps and dents."""
    rng = np.random.default_rng(seed)
    mesh = sm.sphere(frequency)
    directions = rng.normal(size=(lumps, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    height = rng.uniform(-0.3, 0.45, lumps)
    width = rng.uniform(0.25, 0.6, lumps)
    radius = 1 + (height * np.exp((mesh.vertices @ directions.T - 1) / width**2)).sum(axis=1)
    return mesh.moved(mesh.vertices * radius[:, None] * [1.2, 1.0, 0.9])


def form_energy(cut, forms):
    """Half the sum over triangles of the squared gradient times area, twice: the energy of each form."""
    number = {tuple(sorted(pair)): k for k, pair in enumerate(cut.edges.tolist())}
    total = np.zeros(forms.shape[1])
    for a, b, c in cut.faces.tolist():
        values = [np.zeros(forms.shape[1])]
        for other in (b, c):
            k = number[min(a, other), max(a, other)]
            values.append(forms[k] if cut.edges[k, 0] == a else -forms[k])
        one, two = cut.vertices[b] - cut.vertices[a], cut.vertices[c] - cut.vertices[a]
        metric = np.array([[one @ one, one @ two], [one @ two, two @ two]])
        steps = np.stack(values[1:])
        slopes = np.linalg.solve(metric, steps)
        total += (steps * slopes).sum(axis=0) * 0.5 * np.sqrt(np.linalg.det(metric))
    return total


def slid(grid, topology, a, b, row, column, *, flipped):
    """The sum of squared differences of two signatures on a patch under one shift of the grid, and its area."""
    shown = []
    for values, seen in (a, b):
        at = np.einsum("rcj,rcj->rc", values[grid.corners], grid.weights)
        shown.append((at, seen[grid.corners].all(axis=2)))
    (one, there), (other, here) = shown
    rows, columns = one.shape
    total = common = 0.0
    for r in range(rows):
        for c in range(columns):
            at, to = ((-r) % rows if topology == "torus" else rows - 1 - r, -c % columns) if flipped else (r, c)
            q = ((r + row) % rows, (c + column) % columns)
            if there[q] and here[at, to]:
                area = grid.areas[r, 0]
                total += area * (one[q] - other[at, to]) ** 2
                common += area
    return total, common


def on_model(topology, frequency, at):
    """Where places of a patch are on the torus, tube or disc that is drawn."""
    if topology == "plane":
        return np.column_stack([at, 0 * at[:, 0]])
    x, y = 2 * np.pi * at.T
    if topology == "torus":
        reach = 1 + 0.35 * np.cos(y)
        return np.stack([reach * np.cos(x), reach * np.sin(x), 0.35 * np.sin(y)], axis=1)
    tall = 2 * np.pi * np.sqrt(0.75) * (2 * frequency - 1) / (5 * frequency)
    return np.stack([np.cos(x), np.sin(x), tall * (at[:, 1] - 0.5)], axis=1)


def triangles_of(frequency):
    """Every triangle of a vertex and two of its faces' centers: the vertex, the two faces, the inverse of corners."""
    here = sphere_domain(frequency)
    vertex = np.repeat(np.arange(len(here.vertices)), 3)
    faces = here.mesh.connectivity.face
    pairs = np.stack([np.roll(faces, 1, axis=1), faces], axis=2).reshape(-1, 2)
    corners = np.stack([here.vertices[vertex], here.centers[pairs[:, 0]], here.centers[pairs[:, 1]]], axis=2)
    return vertex, pairs, np.linalg.inv(corners)


def residuals(frequency, R, first, seen_first, second, seen):
    """The sum of squares of first(R p) - second(p), how many count, and the normal equations for a small turn."""
    here = sphere_domain(frequency)
    vertex, pairs, inverse = triangles_of(frequency)
    means = np.array([first[loop].mean() for loop in here.mesh.faces])
    total, count, A, b = 0.0, 0, np.zeros((3, 3)), np.zeros(3)
    for p in np.flatnonzero(seen):
        x = R @ here.vertices[p]
        weights = inverse @ x
        at = int(weights.min(axis=1).argmax())
        if not seen_first[vertex[at]]:
            continue
        values = np.array([first[vertex[at]], *means[pairs[at]]])
        whole = weights[at].sum()
        value = values @ weights[at] / whole
        slope = inverse[at].T @ (values - value) / whole
        row, lack = np.cross(x, slope), value - second[p]
        total, count = total + lack**2, count + 1
        A, b = A + np.outer(row, row), b + lack * row
    return total, count, A, b


def turned(w, R):
    """R followed by a turn of |w| about w."""
    angle = np.linalg.norm(w)
    if angle == 0:
        return R.copy()
    x, y, z = w / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K) @ R


def followed(frequency, R, first, seen_first, second, seen, *, least, steps, longest):
    """Levenberg and Marquardt's method for one rotation: the rotation, the mean square difference, how many count."""

    def at(turn):
        total, count, A, b = residuals(frequency, turn, first, seen_first, second, seen)
        return total / count if count >= max(least, 1) else np.inf, count, A, b

    mean, count, A, b = at(R)
    damping = 1e-3
    for _ in range(steps):
        if not mean < np.inf:
            break
        w = -np.linalg.solve(A + damping * np.trace(A) * np.eye(3), b)
        length = np.linalg.norm(w)
        other = turned(w * min(1.0, longest / length), R)
        new, number, new_A, new_b = at(other)
        if new <= mean:
            gain, mean, count, R, A, b = mean - new, new, number, other, new_A, new_b
            damping = max(0.2 * damping, 1e-9)
            if length < 1e-4 or gain <= 1e-7 * mean:
                break
        else:
            damping *= 8.0
            if damping > 1e4 or length < 1e-4:
                break
    return R, mean, count


def plane_fits(points, near):
    """Planes through rows of points: unit normals, mean squared distances to them, the first of each row on it."""
    local = points[near]
    middle = local.mean(axis=1)
    local = local - middle[:, None]
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", local, local) / near.shape[1])
    normals = vectors[:, :, 0]
    first = points[near[:, 0]]
    return normals, values[:, 0], first - normals * ((first - middle) * normals).sum(axis=1)[:, None]


def smooth(values, neighbors, passes):
    """Values replaced by the mean over the vertex and its neighbors, so many times."""
    for _ in range(passes):
        values = np.array([(values[i] + values[row].sum()) / 4 for i, row in enumerate(neighbors)])
    return values


def stretches(flat):
    """J J^T of the map from each triangle to the plane, of determinant one, and the areas of the triangles."""
    tensors, areas = [], []
    for face, corners in zip(flat.faces, flat.corners, strict=True):
        a, b, c = flat.vertices[face]
        normal = np.cross(b - a, c - a)
        first = (b - a) / np.linalg.norm(b - a)
        frame = np.stack([first, np.cross(normal / np.linalg.norm(normal), first)])
        J = np.stack([corners[1] - corners[0], corners[2] - corners[0]], axis=1) @ np.linalg.inv(
            frame @ np.stack([b - a, c - a], axis=1)
        )
        tensors.append(J @ J.T / max(abs(np.linalg.det(J)), 1e-300))
        areas.append(0.5 * np.linalg.norm(normal))
    return np.array(tensors), np.array(areas)


def quadrics(points, near, normals):
    """Polynomials of second degree over planes: the first point of each row on it, and the normal there."""
    places, tilted = [], []
    for row, n in zip(near, normals, strict=True):
        u, v = np.linalg.svd(n[None])[2][1:]
        local = points[row] - points[row[0]]
        x, y, z = local @ u, local @ v, local @ n
        scale = np.abs(local).max()
        x, y = x / scale, y / scale
        a = np.linalg.lstsq(np.stack([x**0, x, y, x * x, x * y, y * y], axis=1), z, rcond=None)[0]
        places.append(points[row[0]] + a[0] * n)
        slope = n - (a[1] * u + a[2] * v) / scale
        tilted.append(slope / np.linalg.norm(slope))
    return np.array(places), np.array(tilted)


def distinct_motions(motions, most, apart, far):
    """Which motions, in order, turn or shift otherwise than all kept before."""
    kept = []
    for k, motion in enumerate(motions):
        R, t = motion.reshape(3, 4)[:, :3], motion.reshape(3, 4)[:, 3]
        others = [motions[i].reshape(3, 4) for i in kept]
        near = [angle(R, each[:, :3]) < np.degrees(apart) and np.linalg.norm(t - each[:, 3]) < far for each in others]
        if len(kept) < most and not any(near):
            kept.append(k)
    return kept


def step_to_planes(motion, samples, grid, low, cell, target, width):
    """A motion after one step of least squares to the planes of the nearest points of a grid, weights by distance."""
    R, t = motion.reshape(3, 4)[:, :3], motion.reshape(3, 4)[:, 3]
    at, normals = samples[:, :3] @ R.T + t, samples[:, 3:] @ R.T
    cells = np.floor((at - low) / cell).astype(int)
    inside = ((cells >= 0) & (cells < grid.shape)).all(axis=1)
    at, normals, cells = at[inside], normals[inside], cells[inside]
    near = target[grid[tuple(cells.T)]]
    offset, up = at - near[:, :3], near[:, 3:]
    far, alike = (offset**2).sum(axis=1) / width**2, (normals * up).sum(axis=1)
    weight = np.where((far <= 4) & (alike >= 0.2), alike / (1 + far) ** 2, 0)
    rows = np.hstack([np.cross(at, up), up])
    damping = 1e-3 * weight.sum() * np.array([0.05] * 3 + [1] * 3) + 1e-9
    x = np.linalg.solve((rows * weight[:, None]).T @ rows + np.diag(damping), -rows.T @ (weight * (offset * up).sum(1)))
    turn = turned(x[:3], np.eye(3))
    return np.hstack([turn @ R, (turn @ t + x[3:])[:, None]]).ravel()
