"""Models and loops for other programs and machines, one format a file."""
