"""The Python interface: what notebooks and the command line both call. Its names are those of `rtctl` itself."""
