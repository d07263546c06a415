"""Beams and flanges: profiles of straight pieces, drawn along an axis or turned about it."""
