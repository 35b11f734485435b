"""The writers of foreign files are those of the readers' tests; the record is that of `rtctl init`."""

from __future__ import annotations

import sys
from pathlib import Path

for _folder in ("measured", "first_look"):
    sys.path.append(str(Path(__file__).parents[1] / _folder))
