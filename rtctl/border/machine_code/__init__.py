"""Machine code of compiled kernels on the disk."""
