"""Hidden effects of a device: which, by which equations, and from when on."""
