"""Models for MATLAB: parameters in .mat files, equations as functions."""
