"""Records of a dataset: read from their tables and files, and what all of them together show of the instrument."""
