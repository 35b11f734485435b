"""A running loop as an instrument of other laboratory programs: QCoDeS and PyMeasure."""
