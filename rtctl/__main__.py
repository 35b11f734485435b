"""`python -m rtctl`."""

import sys

from rtctl.cli import main

if __name__ == "__main__":
    sys.exit(main())
