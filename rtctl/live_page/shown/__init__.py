"""What the page shows of a recording: signals and panels from names and units, events, timing, the run's state."""
