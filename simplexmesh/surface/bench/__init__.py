"""The bench: every estimator of normals and curvatures on surfaces that are known, as Charton compared them in 2014.

`python -m simplexmesh.surface.bench --surfaces all --methods all -o report/`
"""
