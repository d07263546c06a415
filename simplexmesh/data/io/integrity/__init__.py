"""Checks of files before a library written in C++ reads them, which damage can end together with this process."""
