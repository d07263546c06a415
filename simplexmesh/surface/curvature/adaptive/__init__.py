"""The adaptive estimator: polynomials whose neighborhood follows sampling, noise and detail."""
