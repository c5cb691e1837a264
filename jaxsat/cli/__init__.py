"""The `jaxsat` command: the roof of the house, above `fitting`."""
