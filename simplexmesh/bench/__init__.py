"""Surfaces with exact normals and curvatures (`truth`), and a comparison of all estimators on them (`trials`).

`python -m simplexmesh.bench --surfaces all --methods all -o report/` writes its report, after Charton (2014).
"""
