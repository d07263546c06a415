"""Landmarks, circles, junctions, and deformation by landmarks."""
