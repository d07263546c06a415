"""Reading and writing of files, one format a file."""
