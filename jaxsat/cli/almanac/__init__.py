"""`jaxsat almanac`."""
