"""Mean elements: TLE, and OMM in XML, KVN, JSON, CSV."""
