"""Mass-normalised oscillators: z'' = drive_gain u - damping z' - stiffness z - stiffness_cubic z^3, and mechanisms."""
