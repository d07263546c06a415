"""The trials of the benchmark of estimators."""
