"""Parts of a VO2 device as C."""
