"""Plain words for the names of tests and coordinates in the files, for those who read a page or a terminal."""

from __future__ import annotations

TESTS = {
    "catalogue": "any effect of the catalogue",
    "generic forces": "anything that depends on the motion, the drive or the time",
    "past motion and drive": "anything that depends on the past of motion and drive",
    "residual grows with the motion": "an error that grows with the motion",
}
BY_SIZE = ", by size"
"""End of the name of a test that counts an error by its size."""
SIZE = ", each error by its size and not over the noise"


def words_of_test(name: str) -> str:
    """Return what a residual test looks for: `friction.coulomb` of "friction.coulomb alone"."""
    looked_for = name.removesuffix(BY_SIZE)
    size = SIZE if looked_for != name else ""
    return TESTS.get(looked_for, looked_for.removesuffix(" alone")) + size


def words_of_coordinate(name: str) -> str:
    """Return the name of a coordinate as it is read: `velocity sign`."""
    return name.replace("_", " ")
