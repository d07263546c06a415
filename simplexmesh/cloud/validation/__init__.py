"""Selection and validation of fitted models by their residuals, on arrays."""

from simplexmesh.cloud.validation.outcome import Outcome as Outcome
from simplexmesh.cloud.validation.validation import Validation as Validation
from simplexmesh.cloud.validation.validation import validated as validated

__all__ = ["Outcome", "Validation", "validated"]
