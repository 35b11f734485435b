"""Files that hold sweeps of frequencies."""
