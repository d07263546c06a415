"""Benchmark of all estimators of normals and curvatures on surfaces with known values, after Charton (2014).

`python -m simplexmesh.surface.bench --surfaces all --methods all -o report/`
"""
