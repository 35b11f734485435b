"""The bistable beam: regression of restoring forces from 450 shaker records, and its errors."""
