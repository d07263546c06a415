"""Primitives and pipelines of point clouds."""
