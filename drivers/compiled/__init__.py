"""An exchange as one compiled call that holds no interpreter's lock: frame, write, wait, read, check."""
