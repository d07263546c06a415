"""Decimation: fewer vertices with the same shape and topology."""
