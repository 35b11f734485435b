"""The bistable beam: regression of restoring forces from 450 shaker records, and what it gets wrong."""
