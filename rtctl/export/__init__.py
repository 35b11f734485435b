"""Models and controllers for other programs and machines."""
