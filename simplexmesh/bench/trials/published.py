"""Published results: the thesis's ratings (Charton 2014), and other programs' errors."""

from __future__ import annotations

CRITERIA = ("precision", "convergence", "stability", "clouds")

THESIS: dict[str, dict[str, tuple[str, ...]]] = {
    "curvature": {
        "discrete": ("+", "-", "--", "no"),
        "quadric": ("++", "++", "++", "yes"),
        "taubin": ("--", "++", "+", "yes"),
        "langer": ("++", "+", "++", "yes"),
        "chen_schmitt": ("--", "---", "---", "yes"),
        "sine": ("+++", "++", "+++", "yes"),
    },
    "normals": {
        "plane": ("-", "+", "---", "yes"),
        "area": ("+", "+/-", "--", "no"),
        "quadric": ("++", "+++", "+", "yes"),
        "chen_schmitt": ("++", "---", "++", "yes"),
        "extended_sine": ("+++", "+++", "+++", "yes"),
    },
}
"""By kind and our name, one rating for each of `CRITERIA`."""

OTHERS = {
    "libigl, cotangents and angle defect": (0.0014, 0.00035, 0.000087, 0.88, 1.2, 2.1, 1.0, 1.6, 2.8, 4.2, 8.3, 16, 12),
    "VTK": (0.0033, 0.00083, 0.00021, 2.7, 6.2, 9.9, 2.6, 6.0, 9.0, 6.1, 12, 23, 17),
    "PyMeshLab, quadric fitting": (0.039, 0.0095, 0.0024, 0.054, 0.019, 0.013, 0.086, 0.52, 0.35, 0.89, 2.7, 5.5, 8.3),
    "PyMeshLab, APSS": (0.0025, 0.00079, 0.00018, 0.031, 0.034, 0.040, 0.040, 0.062, 0.12, 0.24, 0.48, 0.97, 4.4),
    "libigl, quadrics, 3 rings": (0.083, 0.020, 0.0049, 0.098, 0.025, 0.0078, 0.10, 0.067, 0.12, 0.33, 0.62, 1.2, 3.7),
    "libigl, quadrics, 5 rings": (0.22, 0.052, 0.013, 0.25, 0.061, 0.016, 0.25, 0.066, 0.051, 0.27, 0.25, 0.48, 2.0),
    "PyMeshLab, quadrics at 10 %": (0.21, 0.21, 0.21, 0.21, 0.21, 0.21, 0.21, 0.21, 0.21, 0.25, 0.22, 0.22, 0.50),
    "trimesh, ball measures": (0.057, 0.048, 0.046, 0.11, 0.16, 0.29, 0.12, 0.25, 0.32, 0.36, 0.69, 1.4, 11),
}  # fmt: skip
"""Relative error of H by the first thirteen cases of `meshes.CASES`, of tests/benchmarks/bench_adaptive.py: meshes made
the same way (not the same meshes)."""
