"""What is fuzzed: for each target one case from a random generator, and the errors that are its messages.

A case raises what the program would: a message (one of `messages`) is right, anything else is a traceback for a user.
"""

from __future__ import annotations

import gzip
import random
import struct
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import fuzz_files
import numpy as np
import tomli_w
from fuzz_mutation import any_text, damaged, retabled, rewritten

from rtctl.border.errors import RtctlError

ROOT = Path(__file__).parents[2]
Case = Callable[[random.Random, Path], None]
"""One case: makes its input in the folder and lets the program read it."""


class Target(NamedTuple):
    """One kind of input."""

    case: Case
    messages: tuple[type[Exception], ...]
    """Errors that end in one message for a user."""
    prepare: Callable[[], object] = lambda: None
    """What is made once, before the process is divided."""


def targets() -> dict[str, Target]:
    """Return all targets by name."""
    suffixes = (".csv", ".csv.gz", ".parquet", ".arrow", ".npz", ".mat", ".h5", ".tdms", ".uff")
    found = {
        f"read{suffix}": Target(_reading(suffix), (ValueError, RtctlError), _seeds) for suffix in suffixes
    }
    found |= {f"toml.{kind}": Target(_toml(kind), (RtctlError,)) for kind in _LOADERS}
    found |= {f"text.{kind}": Target(case, (ValueError, RtctlError)) for kind, case in _TEXTS.items()}
    found["init"] = Target(_init, (RtctlError,), _seeds)
    found["codec.serial"] = Target(_serial, ())
    found["codec.serial-compiled"] = Target(_serial_compiled, (), _compile_serial)
    found["codec.modbus-rtu"] = Target(_modbus_rtu, ())
    found["codec.modbus-tcp"] = Target(_modbus_tcp, (ValueError,))
    found["codec.scpi"] = Target(_scpi, (RtctlError,))
    return found


@cache
def _seeds() -> dict[str, list[bytes]]:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        return fuzz_files.files(Path(folder))


def _bad_file(rng: random.Random, suffix: str) -> bytes:
    seeds = _seeds()[suffix]
    seed = rng.choice(seeds)
    if suffix == ".csv.gz" and rng.random() < 0.7:
        return gzip.compress(_bad_file(rng, ".csv"), compresslevel=1, mtime=0)
    if suffix in (".csv", ".uff") and rng.random() < 0.6:
        return rewritten(rng, seed.decode("latin-1")).encode("utf-8", "surrogatepass")
    if rng.random() < 0.02:
        return rng.randbytes(rng.randrange(200))
    return damaged(rng, seed, rng.choice(seeds))


def _reading(suffix: str) -> Case:
    def case(rng: random.Random, folder: Path) -> None:
        from rtctl.measured.columns.conversion import TableCache
        from rtctl.measured.columns.time_column import choose_time_unit, seconds

        path = folder / f"r{suffix}"
        path.write_bytes(_bad_file(rng, suffix))
        cache = TableCache()
        for name in cache.table(path).columns:
            try:
                stated = cache.stated_unit(path, name)
                cache.remarks(path, name, "mm")
                cache.column(path, name, None)
                raw = cache.raw(path, name, 1, min(cache.rows(path, name), 9))
                seconds(raw, choose_time_unit(None, stated, name), name, 1)
            except ValueError:
                continue

    return case


def _init(rng: random.Random, folder: Path) -> None:
    import rtctl

    suffix = rng.choice(list(_seeds()))
    path = folder / f"r{suffix}"
    path.write_bytes(_bad_file(rng, suffix))
    inputs = rng.choice(("", "u:V", "u"))
    rtctl.init(
        path, out=folder / "out", inputs=[inputs] if inputs else (), force=True, plot=False,
        sample_rate_hz=rng.choice((None, 1000.0)),
    )  # fmt: skip


_MANIFEST = """
[dataset]
name = "shaker run 7"
plant = "oscillator"
[signals.drive]
role = "input"
unit = "V"
hold = "zero"
column = "u"
[signals.displacement]
role = "output"
unit = "mm"
column = "x"
scale = 2.0
offset = 0.5
[[records]]
file = "r.csv"
time = "t"
time_unit = "s"
rows = [0, 40]
ignore_first = 5
use = "fit"
initial = { displacement = "0.5 mm", velocity = "0 mm/s" }
[[records]]
file = "r.csv"
name = "second"
sample_rate_hz = 1000.0
use = "test"
repeat = "A"
conditions = { frequency_hz = 10.25 }
"""
_DATA = "t,u,x\n" + "".join(
    f"{t:.4f},{u:.5g},{x:.5g}\n" for t, u, x in zip(fuzz_files.T, fuzz_files.U, fuzz_files.X, strict=True)
)


def _load_manifest(path: Path) -> None:
    from rtctl.measured import read_dataset

    (path.parent / "r.csv").write_text(_DATA)
    read_dataset(path)


def _load_model(path: Path) -> None:
    import rtctl

    rtctl.read_model(path)


def _load_scenario(path: Path) -> None:
    from rtctl.scenario.schema import load_scenario

    load_scenario(path, [])


def _load_campaign(path: Path) -> None:
    from rtctl.campaign.file import read_campaign

    read_campaign(path)


def _load_vo2(path: Path) -> None:
    from plant_sim.vo2.device_file import read_device

    read_device(path)


def _load_oscillator(path: Path) -> None:
    from plant_sim.oscillator.plant import load_plant

    load_plant(path)


def _load_equations(path: Path) -> None:
    from plant_sim.equations.reading import read_equations

    read_equations(path)


def _load_instrument(path: Path) -> None:
    from drivers.scpi.table import load_table

    load_table(str(path), path.parent)


_LOADERS: dict[str, tuple[Callable[[Path], None], tuple[str, ...]]] = {
    "manifest": (_load_manifest, ()),
    "model": (_load_model, ("scenarios/models/*.toml",)),
    "equations": (_load_equations, ("scenarios/models/equations/*.toml",)),
    "scenario": (_load_scenario, ("scenarios/*.toml",)),
    "campaign": (_load_campaign, ("scenarios/sweeps/*.toml",)),
    "instrument": (_load_instrument, ("drivers/scpi/tables/*.toml",)),
    "device-vo2": (_load_vo2, ("plant_sim/vo2/devices/*.toml",)),
    "device-oscillator": (_load_oscillator, ("plant_sim/oscillator/devices/*.toml",)),
}
"""Loader and valid files by kind of TOML."""


@cache
def _valid_tomls(kind: str) -> tuple[str, ...]:
    _, patterns = _LOADERS[kind]
    return tuple(file.read_text() for one in patterns for file in sorted(ROOT.glob(one))) or (_MANIFEST,)


def _toml(kind: str) -> Case:
    load, _ = _LOADERS[kind]

    def case(rng: random.Random, folder: Path) -> None:
        text = rng.choice(_valid_tomls(kind))
        if rng.random() < 0.6:
            content = _dumped(retabled(rng, tomllib.loads(text)))
        elif rng.random() < 0.7:
            content = rewritten(rng, text).encode("utf-8", "surrogatepass")
        else:
            content = damaged(rng, text.encode(), text.encode())
        path = folder / "a.toml"
        path.write_bytes(content)
        load(path)

    return case


def _dumped(tables: object) -> bytes:
    try:
        return tomli_w.dumps(tables).encode("utf-8", "surrogatepass")  # type: ignore[arg-type]
    except (TypeError, ValueError, AttributeError):  # a change that TOML cannot hold
        return b""


_UNITS = ("m", "mm", "s", "^2", "**", "*", "/", "(", ")", "V", "ohm", "9", "1e", "-", " ", "deg", "C", "d", "B", "°",
          "µ", "g", "Hz", "[", "]", "since", "k", "%", "²", ".", "_")  # fmt: skip
_TERMS = ("x1", "u", "k1", "sqrt", "sin", "max", "min", "where", "sign", "(", ")", "*", "/", "+", "-", "^", "**", ",",
          "1e3", "0", "2.5", " ", "<", ">", "==", "and", "lambda", "__class__", "[0]", ".")  # fmt: skip


def _unit_text(rng: random.Random, folder: Path) -> None:
    from rtctl.border.units.unit_text import parsed_unit
    from rtctl.measured.stated_unit import agrees, readable, time_unit_of, unit_in_name

    text = any_text(rng, _UNITS)
    readable(text)
    unit_in_name(f"x [{text}]")
    readable(time_unit_of(text))
    if readable(text):
        agrees(text, "mm")
    parsed_unit(text)


def _quantity_text(rng: random.Random, folder: Path) -> None:
    from rtctl.border.units.quantities import parse_quantity
    from rtctl.border.units.unit_text import parse_base_quantity

    text = rng.choice(("1 ", "2.5", "-1e-3 ", "")) + any_text(rng, _UNITS)
    try:
        parse_base_quantity(text)
    except ValueError:
        parse_quantity(text, rng.choice(("s", "mm", "V/s", "")))


def _expression_text(rng: random.Random, folder: Path) -> None:
    from plant_sim.equations.language.parser import parse

    parse(any_text(rng, _TERMS))


def _column_name(rng: random.Random, folder: Path) -> None:
    from rtctl.measured.proposal.naming.column_units import read_column
    from rtctl.measured.proposal.survey import Column

    names = (
        "x",
        "tip",
        "Weg",
        "_",
        " ",
        "/",
        "mm",
        "in",
        "acc",
        "(",
        ")",
        "[",
        "]",
        "t",
        "Zeit",
        ":",
        "#",
        "°",
    )
    name = any_text(rng, names)
    read_column(Column(name=name, raw=fuzz_files.X, values=fuzz_files.X))


_TEXTS: dict[str, Case] = {
    "unit": _unit_text,
    "quantity": _quantity_text,
    "expression": _expression_text,
    "column-name": _column_name,
}


def _wire_bytes(rng: random.Random, valid: Callable[[random.Random], bytes]) -> bytes:
    stream = b"".join(valid(rng) for _ in range(rng.randrange(1, 4)))
    return stream if rng.random() < 0.1 else damaged(rng, stream, stream)


def _serial_frame(rng: random.Random) -> bytes:
    from rtctl.border.records import VO2
    from rtctl.border.wire.serial_frames import frame

    size = rng.choice((0, 4, 8, 19, struct.calcsize("<HHIIf") + 4 * len(VO2.sensed), rng.randrange(200)))
    payload = bytes(size) if rng.random() < 0.3 else rng.randbytes(size)
    return frame(
        rng.choice((0x01, 0x81, 0x82, 0x83, 0x84, 0xFF, rng.randrange(256))), rng.randrange(1 << 16), payload
    )


def _serial(rng: random.Random, folder: Path) -> None:
    from rtctl.border.records import ME, VO2
    from rtctl.border.wire.serial_frames import FrameReader, Layout, frame, identity_of, settings_of

    data = _wire_bytes(rng, _serial_frame)
    whole, reader = FrameReader().feed(data), FrameReader()
    cut = rng.randrange(len(data) + 1)
    pieces = [*reader.feed(data[:cut]), *reader.feed(data[cut:])]
    assert pieces == whole, "messages depend on the pieces in which bytes arrive"
    layout = Layout(rng.choice((VO2, ME)))
    for message in whole:
        settings_of(message.payload)
        identity_of(message.payload)
        layout.levels(message.payload)
        measured = layout.measurement(message.payload)
        if measured is not None and not np.isnan([*measured.sensed, measured.reference]).any():
            assert layout.reading(measured) == message.payload, (
                "a reading does not pack to what it was read from"
            )
        again = FrameReader().feed(frame(message.type, message.tag, message.payload))
        assert again == [message], "a frame does not come back"


def _compile_serial() -> None:
    _serial_compiled(random.Random(0), Path())


def _serial_compiled(rng: random.Random, folder: Path) -> None:
    """The compiled codec believes what Python's believes, of any bytes."""
    from drivers.compiled.serial import read_message, unstuffed
    from rtctl.border.records import VO2
    from rtctl.border.wire.serial_frames import Layout, unframe
    from rtctl.border.wire.wire_memory import OK, SEQUENCE, STALE, wire_memory

    memory, layout = wire_memory(VO2), Layout(VO2)
    for stuffed in _wire_bytes(rng, _serial_frame).split(b"\0"):
        if not stuffed or len(stuffed) > 255:
            continue
        message = unframe(stuffed)
        memory.inbox[: len(stuffed)] = np.frombuffer(stuffed, np.uint8)
        memory.line[SEQUENCE] = 7 if message is None else message.tag
        length = unstuffed(memory.inbox, 0, len(stuffed))
        ended = read_message(memory.reading, memory.line, memory.inbox, 0, max(length, 0))
        if ended in (OK, STALE):
            assert message is not None, "compiled code believes a damaged frame"
            told = layout.measurement(message.payload)
            assert told is not None, "compiled code reads a payload of another length"
            assert np.array_equal(memory.reading, [*told.sensed, told.reference], equal_nan=True)


def _modbus_reply(rng: random.Random) -> bytes:
    count = rng.choice((20, 20, 4, rng.randrange(0, 250, 2)))
    return bytes((rng.choice((3, 16, 23, 0x83, 0x97, rng.randrange(256))), count)) + rng.randbytes(count)


def _modbus_rtu(rng: random.Random, folder: Path) -> None:
    from drivers.modbus_frames import from_rtu, to_rtu

    data = _wire_bytes(rng, lambda one: to_rtu(1, _modbus_reply(one)))
    pdu = from_rtu(1, data)
    assert pdu is None or to_rtu(1, pdu) in data, "a reply is believed that did not arrive"


def _modbus_tcp(rng: random.Random, folder: Path) -> None:
    from drivers.modbus_frames import from_tcp, to_tcp

    data = _wire_bytes(rng, lambda one: to_tcp(one.randrange(1 << 16), 1, _modbus_reply(one)))
    reply = from_tcp(data)
    if reply is not None:
        assert to_tcp(reply.transaction, reply.unit, reply.pdu) == data[: reply.used], (
            "a reply does not come back"
        )


_ANSWERS = (b"+1.000206E+00,+1.000000E-04,+34816", b"2.5E+00,5.0E-03,160", b"+9.9E+37,+9.91E+37,0",
            b'-222,"Parameter data out of range"', b"0.00000e+00\tQueue Is Empty\t0.00000e+00")  # fmt: skip


def _scpi(rng: random.Random, folder: Path) -> None:
    """Answers of an instrument, and messages to a simulated one: words or a fault, never anything else."""
    from drivers.scpi.answers import error_of, is_off, reading_of
    from drivers.scpi.table import load_table
    from plant_sim.wire.scpi.grammar import units_of

    said = rng.choice(_ANSWERS)
    text = damaged(rng, said, said).decode("ascii", "replace")
    is_off(text)
    units_of(text)
    reader = rng.choice((error_of, lambda one: reading_of(one, load_table("keithley-2400", Path()).answer)))
    reader(text)
