"""Targets: how far along its normal is the data from each vertex."""
