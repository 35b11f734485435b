"""What a signal goes through outside the equations, as C, for any kind of plant."""


def line_size(kept: int) -> int:
    """Return how many numbers a delayed input is (`line` in delay.c) of so many communication steps."""
    return 2 + 3 * kept
