"""A model of one's own equations for other programs: differential equations, a MATLAB function."""
