"""Spherical attribute images: shape signatures, and their comparison."""
