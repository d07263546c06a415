"""Ground truth: surfaces with exact normals and curvatures, and ways to sample them, for tests of estimators."""
