"""Models for other programs: functional mock-up units, SciPy and python-control, MATLAB."""
