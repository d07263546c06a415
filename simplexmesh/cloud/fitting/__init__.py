"""Fits of primitives to points: initial values, least squares, robust fits and the choice of the kind."""
