"""Links of an HDF5 group: other names of its datasets, links that lead nowhere, links into other files."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator
from typing import Any, NamedTuple

import h5py


class Link(NamedTuple):
    """A link that is no dataset of its own."""

    name: str
    target: Any = None
    """The dataset of this file that it leads to; None: it leads to none."""
    leads_to: str = ""
    """Path of the dataset."""
    refusal: str = ""
    """Why it is no column, as a phrase that continues its name."""


def links_of(group: Any) -> Iterator[Link]:
    """Yield the links of an h5py group to datasets of other names, and those that cannot be followed."""
    for key in group:
        link = group.get(key, getlink=True)
        name = f"{group.name.rstrip('/')}/{key}".lstrip("/")
        if isinstance(link, h5py.ExternalLink):
            yield Link(
                name,
                refusal=f'is a link to "{link.path}" in another file, {link.filename}, which is not followed: copy the '
                "dataset into this file (h5copy), or name that file",
            )
        elif isinstance(link, h5py.SoftLink):
            target = group.get(key)
            if target is None:
                yield Link(
                    name,
                    refusal=f'is a link to "{link.path}", which is not in the file: correct the link, or copy the '
                    "dataset to where it leads",
                )
            elif isinstance(target, h5py.Dataset) and link.path.rpartition("/")[2] != key:
                yield Link(
                    name, target, posixpath.normpath(posixpath.join(group.name, link.path)).lstrip("/")
                )
