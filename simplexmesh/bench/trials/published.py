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
    "libigl, cotangents and angle defect": (0.002, 0.0005, 0.0001, 0.79, 1.2, 2.3, 0.94, 1.5, 3.0, 4.3, 8.6, 17, 12),
    "VTK": (0.004, 0.001, 0.0002, 2.5, 4.2, 12, 2.7, 4.7, 9.8, 6.3, 12, 25, 17),
    "PyMeshLab, quadric fitting": (0.047, 0.011, 0.003, 0.062, 0.019, 0.013, 0.094, 0.14, 0.36, 0.71, 2.1, 6.0, 8.4),
    "PyMeshLab, APSS": (0.006, 0.001, 0.0003, 0.030, 0.034, 0.048, 0.038, 0.060, 0.12, 0.26, 0.48, 0.99, 4.7),
    "libigl, quadrics, 3 rings": (0.10, 0.023, 0.006, 0.11, 0.028, 0.008, 0.12, 0.072, 0.13, 0.35, 0.66, 1.3, 3.7),
    "libigl, quadrics, 5 rings": (0.28, 0.060, 0.014, 0.31, 0.069, 0.017, 0.31, 0.074, 0.053, 0.32, 0.26, 0.50, 2.0),
    "PyMeshLab, quadrics at 10 %": (0.22, 0.22, 0.21, 0.21, 0.21, 0.21, 0.21, 0.22, 0.21, 0.25, 0.23, 0.22, 0.55),
    "trimesh, ball measures": (0.036, 0.029, 0.030, 0.059, 0.16, 0.42, 0.062, 0.24, 0.46, 0.53, 0.96, 1.4, 10),
}  # fmt: skip
"""Relative error of H by the first thirteen cases of `meshes.CASES`, measured in November 2026 on meshes made the same
way (not the same meshes)."""
