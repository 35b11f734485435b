"""Execute the notebooks of this folder and keep their outputs in them.

    python docs/notebooks/make.py [--check] [NAME ...]

With `--check` nothing is written: the exit code is 1 where a cell fails or a notebook shows other kinds of outputs than
the stored ones. A notebook runs in an empty folder, so that it needs nothing but the program. `make weekly`
installs what runs them.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

HERE = Path(__file__).resolve().parent
TIMEOUT_S = 600
"""Of a cell."""


def executed(path: Path) -> Any:
    """Return the notebook with the outputs of this run. Raises CellExecutionError."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory(prefix="rtctl-notebook-") as folder:
        client = NotebookClient(notebook, timeout=TIMEOUT_S, kernel_name="python3")
        client.execute(cwd=folder)
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # times, which differ from run to run
    notebook.metadata.pop("language_info", None)
    return notebook


def kinds_of_outputs(notebook: Any) -> list[list[str]]:
    """Return the kinds of output of each code cell: "stream", or the richest form of a result."""
    return [
        [
            output.output_type if output.output_type == "stream" else max(output.get("data", {"error": ""}))
            for output in cell.outputs
        ]
        for cell in notebook.cells
        if cell.cell_type == "code"
    ]


def main() -> int:
    """Run the notebooks that are named, or all. Returns 1 where one fails or differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="file names without suffix (default: all)")
    parser.add_argument("--check", action="store_true", help="write nothing, compare kinds of outputs")
    args = parser.parse_args()
    # the kernel imports the program that this script belongs to, installed or not
    os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")])
    bad = 0
    for path in sorted(HERE.glob("*.ipynb")):
        if args.names and path.stem not in args.names:
            continue
        try:
            notebook = executed(path)
        except CellExecutionError as error:
            print(f"{path.name}: {error}", file=sys.stderr)
            bad += 1
            continue
        if not args.check:
            nbformat.write(notebook, path)
            print(f"wrote {path}")
        elif kinds_of_outputs(notebook) != kinds_of_outputs(nbformat.read(path, as_version=4)):
            print(
                f"{path.name}: other outputs than the stored ones; run docs/notebooks/make.py",
                file=sys.stderr,
            )
            bad += 1
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
