"""What `rtctl export` writes, one format a file."""
