"""RAW_SUN, the session files of Munin: read, cleaned, written."""
