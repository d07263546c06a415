"""Creases: sharp edges of the data as paths along the edges of a simplex mesh, and motion that keeps them sharp."""
