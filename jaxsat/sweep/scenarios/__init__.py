"""Bundled scenarios, one a file: each is found by its file's name, and summed up by its first line."""
