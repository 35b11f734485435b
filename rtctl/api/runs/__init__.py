"""Runs of a loop: started, watched, doubted, replayed."""
