"""The literature's estimators of curvature, one a file."""
