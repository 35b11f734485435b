"""The rows of a run for other programs, while it lasts and afterwards: UDP packets, MCAP, EPICS."""
