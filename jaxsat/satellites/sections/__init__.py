"""The tables of a satellite file, each with its limits; units are those of the file."""
