"""What a file states of its columns: units, packing, scales, sample rates."""
