"""Models, loops and runs for other programs and machines."""
