"""Tables of telemetry, CSV or Parquet, read by what a satellite file says of them."""
