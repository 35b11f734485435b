"""What HDF5 keeps of a dataset beside its numbers: whether they are there, and what their sources say of them."""
