"""A unit as one file: description, sources and a binary in a ZIP archive that is the same to the bit each time."""

from __future__ import annotations

import hashlib
import re
import tempfile
import zipfile
from collections.abc import Mapping
from importlib.resources import files as package_files
from pathlib import Path

from rtctl.border.exported.c_plant import HEADER, CPlant, sizes
from rtctl.export.fmu.binary import can_compile_for, compile_unit
from rtctl.export.fmu.description import Described, build_description, model_description
from rtctl.export.fmu.variables import tables, variables_of
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of

SHARED = ("component.c", "component.h", "exported.h")
OF_VERSION = {
    "3.0": ("fmi3.c", "fmi3_instance.h", "fmi3_types.h", "fmi3_unused.c"),
    "2.0": ("fmi2.c", "fmi2_types.h"),
}
COMMAND = "export fmu"
WRITTEN_AT = (1980, 1, 1, 0, 0, 0)
"""Time of each member: the earliest that an archive can tell."""


def write_unit(
    plant: CPlant, path: Path, *, version: str, name: str, step_s: float, compiler: str | None
) -> Described:
    """Write the unit of a plant, whole or not at all, and return its description.

    Args:
        plant: The plant.
        path: File to write.
        version: Version of FMI, "3.0" or "2.0".
        name: Name of the model for people.
        step_s: Communication step that is proposed [s].
        compiler: C compiler for the binary; None: sources alone.

    Raises:
        InputError: Two variables would have one name.
        RunError: The compiler fails.
    """
    variables = variables_of(plant, name)
    written = {
        "plant.h": HEADER.read_text(encoding="utf-8"),
        "plant_sizes.h": "".join(f"#define {word} {count}\n" for word, count in sizes(plant).items()),
        "plant.c": '#include "plant.h"\n' + plant.source,
        "variables.h": tables(variables),
    }
    folder = package_files("rtctl.export.fmu") / "sources"
    for one in (*SHARED, *OF_VERSION[version]):
        written[one] = (folder / one).read_text(encoding="utf-8")
    token = _token(written, version)
    written["token.h"] = f'#define TOKEN "{token}"\n'
    unit = Described(
        plant=plant, name=name, identifier=identifier_of(name), token=token, step_s=step_s, variables=variables,
        sources=tuple(sorted(one for one in written if one.endswith(".c"))),
    )  # fmt: skip
    members: dict[str, str | bytes] = {"modelDescription.xml": model_description(unit, version)}
    members |= {f"sources/{one}": text for one, text in sorted(written.items())}
    if version == "3.0":
        members["sources/buildDescription.xml"] = build_description(unit)
    target = can_compile_for(version)
    if compiler is not None and target is not None:
        with tempfile.TemporaryDirectory(prefix="rtctl-fmu-") as work:
            library = compile_unit(written, unit.sources, unit.identifier, Path(work), compiler)
        members[f"binaries/{target}/{unit.identifier}.so"] = library
    _write_archive(path, members)
    return unit


def identifier_of(name: str) -> str:
    """Return a name as a C identifier: simulators name the binary and prefix functions by it."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if re.match(r"[A-Za-z_]", plain) else f"model_{plain}"


def _token(written: Mapping[str, str], version: str) -> str:
    """Return a UUID that follows from the sources: units are the same if their sources are."""
    whole = "\0".join([version, *(f"{name}\0{text}" for name, text in sorted(written.items()))])
    digest = hashlib.sha256(whole.encode()).hexdigest()
    return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"


def _write_archive(path: Path, members: Mapping[str, str | bytes]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path, COMMAND) as partial, zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.comment = mark_of(COMMAND).encode()
        for name, content in members.items():
            info = zipfile.ZipInfo(name, WRITTEN_AT)
            info.compress_type, info.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(info, content)
