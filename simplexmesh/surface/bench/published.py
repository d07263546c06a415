"""Published results: the thesis's ratings (Charton 2014), the article's noise (2012), other programs' errors."""

from __future__ import annotations

from simplexmesh.surface.bench.noise_errors import VORONOI

CRITERIA = ("precision", "convergence", "stability", "clouds", "complexity")

THESIS: dict[str, dict[str, tuple[str, ...]]] = {
    "curvature": {
        "discrete": ("DCO", "+", "-", "--", "no", "n"),
        "quadric": ("SQFA", "++", "++", "++", "yes", "n^2"),
        "taubin": ("Taubin", "--", "++", "+", "yes", "n^2"),
        "langer": ("Langer", "++", "+", "++", "yes", "n^2"),
        "chen_schmitt": ("ChenSchmitt", "--", "---", "---", "yes", "n^2 log n"),
        "sine": ("SineFitting", "+++", "++", "+++", "yes", "n^2"),
    },
    "normals": {
        "plane": ("PlaneFitting", "-", "+", "---", "yes", "n^2"),
        "area": ("AreaWeighted", "+", "+/-", "--", "no", "n"),
        "quadric": ("ExtendedQuadricFitting", "++", "+++", "+", "yes", "n^2"),
        "chen_schmitt": ("ChenSchmitt", "++", "---", "++", "yes", "n^2 log n"),
        "extended_sine": ("ExtendedSineFitting", "+++", "+++", "+++", "yes", "k n^2"),
    },
}
"""By kind and our name: the thesis's name, precision, convergence, stability, clouds, complexity in neighbors."""

NOISE: dict[str, dict[str, dict[str, tuple[float | None, ...]]]] = {
    "normals": {
        "H": {
            VORONOI: (7.09784e-10, 0.088116, 0.204693, 0.711943, 1.90416),
            "quadric": (2.79425e-05, 0.0881294, 0.204738, 0.712565, 1.91082),
            "extended_quadric": (5.35647e-05, 0.0881383, 0.204763, 0.712999, 1.92044),
        },
        "K": {
            VORONOI: (2.73413e-05, 0.0879293, 0.210071, 0.872929, None),
            "quadric": (2.79485e-05, 0.0878435, 0.207905, 0.794308, 4.07935),
            "extended_quadric": (5.3564e-05, 0.0878645, 0.207958, 0.79513, 4.11073),
        },
    },
    "directions": {
        "H": {
            VORONOI: (7.09784e-10, 0.100438, 0.232241, 0.749053, 1.95398),
            "quadric": (2.79425e-05, 0.100451, 0.232257, 0.74954, 1.95615),
            "extended_quadric": (5.35647e-05, 0.100462, 0.232302, 0.750363, 1.96986),
        },
        "K": {
            VORONOI: (2.73413e-05, 0.100682, 0.237724, 0.935125, 4.94011),
            "quadric": (2.79485e-05, 0.100412, 0.234754, 0.851028, 4.35306),
            "extended_quadric": (5.3564e-05, 0.100438, 0.234838, 0.852516, 4.39809),
        },
    },
}
NOISE_AMOUNTS = (0.0, 0.0001, 0.0002, 0.0005, 0.001)
"""Amounts of the mean |error| in the article's tables 10 and 11; one entry is illegible."""

OTHERS = {
    "libigl, cotangents and angle defect": (0.002, 0.0005, 0.0001, 0.79, 1.2, 2.3, 0.94, 1.5, 3.0, 4.3, 8.6, 17, 12),
    "VTK": (0.004, 0.001, 0.0002, 2.5, 4.2, 12, 2.7, 4.7, 9.8, 6.3, 12, 25, 17),
    "PyMeshLab, quadric fitting": (0.047, 0.011, 0.003, 0.062, 0.019, 0.013, 0.094, 0.14, 0.36, 0.71, 2.1, 6.0, 8.4),
    "PyMeshLab, APSS": (0.006, 0.001, 0.0003, 0.030, 0.034, 0.048, 0.038, 0.060, 0.12, 0.26, 0.48, 0.99, 4.7),
    "libigl, quadrics, 3 rings": (0.10, 0.023, 0.006, 0.11, 0.028, 0.008, 0.12, 0.072, 0.13, 0.35, 0.66, 1.3, 3.7),
    "libigl, quadrics, 5 rings": (0.28, 0.060, 0.014, 0.31, 0.069, 0.017, 0.31, 0.074, 0.053, 0.32, 0.26, 0.50, 2.0),
    "PyMeshLab, quadrics at 10 %": (0.22, 0.22, 0.21, 0.21, 0.21, 0.21, 0.21, 0.22, 0.21, 0.25, 0.23, 0.22, 0.55),
    "trimesh, ball measures": (0.036, 0.029, 0.030, 0.059, 0.16, 0.42, 0.062, 0.24, 0.46, 0.53, 0.96, 1.4, 10),
}  # fmt: skip
"""Relative error of H by the first thirteen cases of `peers.CASES`, measured in November 2026 on meshes made the same
way (not the same meshes)."""
