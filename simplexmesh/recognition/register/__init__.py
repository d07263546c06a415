"""Rigid registration of two surfaces."""
