"""Normal estimators, from faces and from neighbors, and the function that selects among them."""
