"""Changes of topology: holes, handles, and wrapping of data from outside."""
