"""`jaxsat init`."""
