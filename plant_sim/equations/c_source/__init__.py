"""A model of one's own equations as C."""
