"""Normal estimators, one per file, and the function that selects among them."""
