"""The loop without the interpreter's lock: blocks of steps as one compiled call; Python in between, and for faults."""
