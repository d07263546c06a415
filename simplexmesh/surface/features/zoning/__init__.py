"""Zones of surfaces between their feature lines: growth, edits, and what each zone is."""
