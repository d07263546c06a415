"""Normal estimators, one a file, and the door to all of them."""
