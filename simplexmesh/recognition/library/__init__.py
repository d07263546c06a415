"""Libraries of models, and the recognition of models in scans."""
