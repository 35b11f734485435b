"""Signals of a scenario: references that the loop tracks and excitations that it plays open-loop."""
