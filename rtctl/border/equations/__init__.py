"""Model files of equations: the tables, without what their texts mean."""
