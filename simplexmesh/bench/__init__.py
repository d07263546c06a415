"""Surfaces with exact normals and curvatures (`truth`), and a comparison of all estimators on them (`trials`)."""
