"""The configuration: all settings in one file, resolved once into the objects that the floors below take."""
