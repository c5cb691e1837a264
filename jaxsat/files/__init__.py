"""Files of every kind: read whole or refused in one line, written whole or not at all."""
