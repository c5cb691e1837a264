"""`jaxsat versions`."""
