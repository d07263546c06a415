"""Reconstruction of a surface model from data in one call."""
