"""Loops of devices that are described by equations: a PID on the controlled output, which is read or estimated."""
