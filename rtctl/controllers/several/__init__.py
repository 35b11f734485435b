"""Controllers of several outputs at once."""
