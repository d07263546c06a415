"""Surfaces whose normals and curvatures are known exactly, and ways to sample them: what estimators are judged by."""
