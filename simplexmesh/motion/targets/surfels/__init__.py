"""Surfels: points converted to small quadratic surface pieces, and the signed distances to them."""
