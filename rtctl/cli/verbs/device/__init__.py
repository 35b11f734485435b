"""Verbs that work on a device or on the recording of a run."""
