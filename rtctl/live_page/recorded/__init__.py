"""Rows of a run for a watcher: growing, finished, killed, or a record of a dataset; found in a folder, followed."""
