"""Simulated devices and the machine that runs the loop: `serve`, `serve_device`, `demonstrate`, `measure_latency`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtctl.api.inputs import PathText, Settings, override_texts, path_of
from rtctl.api.runs.errors import ErrorFigures, error_figures
from rtctl.border.errors import InputError, nearest
from rtctl.border.options import check_integer
from rtctl.extras import can_draw
from rtctl.output.interrupt import stop_on_interrupt
from rtctl.output.notebook import html_table, number
from rtctl.output.progress import Progress, reporter

if TYPE_CHECKING:
    from rtctl.session.latency import Ladder, Rung
    from rtctl.timing.histogram import Histogram


@contextmanager
def serve_device(
    device: PathText = "vo2_a", *, seed: int = 1, progress: Progress = False
) -> Iterator[dict[str, Any]]:
    """Serve a simulated device by another process behind a virtual serial line, inside a `with` block.

    Args:
        device: Plant file, or the name of a bundled one.
        seed: Seed of its noise.
        progress: True prints where it is, a callable hears (text, None).

    Yields:
        Keys of [driver] that lead to it, as `run` and `acquire` take them: `with ... as driver: run(driver=driver)`.

    Raises:
        RunError: The device did not start.
    """
    from rtctl.session.demo import served_device

    check_integer("seed", seed, 0, 2**63 - 1)
    with served_device(str(path_of("device", device)), seed, reporter(progress).say) as port:
        yield {"kind": "modbus-rtu", "port": port}


# 13 parameters because each is an option of `rtctl serve`
def serve(  # noqa: PLR0913
    device: PathText,
    *,
    seed: int | None = None,
    rtu_path: PathText | None = None,
    serial_path: PathText | None = None,
    tcp: str | None = None,
    scpi: str | None = None,
    instrument: str = "keithley-2450",
    voltmeter: str | None = None,
    baud: int | None = None,
    journal: PathText | None = None,
    faults: str = "",
    record: PathText | None = None,
    page: int | bool = False,
) -> None:
    """Serve a simulated device on a wire until Ctrl-C or SIGTERM; it blocks.

    Args:
        device: Plant file, or the name of a bundled one.
        seed: Seed of the noise; None: the plant file's.
        rtu_path: Link to a pseudo-terminal that speaks Modbus RTU.
        serial_path: The same with the plain serial protocol.
        tcp: HOST:PORT for Modbus TCP; port 0: a free one, printed.
        scpi: HOST:PORT, or the link to a pseudo-terminal, of a simulated source meter in front of the device.
        instrument: Which source meter: keithley-2400, keithley-2450, keithley-2600 or keysight-b2900.
        voltmeter: The same places, for a voltmeter that reads the external instrument at 0.1 V a unit.
        baud: The bytes of a pseudo-terminal take the time of such a line [1/s]; None: no time.
        journal: CSV file of what the device did, written at its end.
        faults: What goes wrong on purpose: a TOML file, or a text such as "drop rate=0.01; sensor_fault at=5s
            duration=200ms"; "": nothing.
        record: Folder into which what the device really does is recorded, like a run.
        page: Port of a live page of the device, 0 a free one; True: the usual one; False: there is none.

    Raises:
        InputError: There is no such device, or the wire cannot be opened.
    """
    from rtctl.scenario.serving import ServedAt, ServedFaults, read_faults
    from rtctl.wiring_served import serve_plant

    if journal is not None:
        _check_journal(path_of("journal", journal))
    paths = {"rtu_path": rtu_path, "serial_path": serial_path, "journal": journal}
    where = ServedAt(
        tcp=tcp,
        scpi=scpi,
        instrument=instrument,
        voltmeter=voltmeter,
        baud=baud,
        **{name: None if path is None else path_of(name, path) for name, path in paths.items()},
    )
    name = str(path_of("device", device))
    if not faults and record is None and page is False:
        serve_plant(name, seed, where)
        return
    from rtctl.session.bench.serving import serve_on_bench

    serve_on_bench(
        name, seed, where,
        faults=read_faults(faults, on_tcp=tcp is not None) if faults else ServedFaults(),
        record=None if record is None else path_of("record", record),
        page=None if isinstance(page, bool) else page, has_page=page is not False,
    )  # fmt: skip


def _check_journal(path: Path) -> None:
    """Raise InputError where something is at `path` that is no journal of a device."""
    from rtctl.wiring_served import is_journal

    if path.exists() and not is_journal(path):
        raise InputError(f"{path}: is there already, and no journal of rtctl serve: choose another --journal")


class Demonstration(list[dict[str, Any]]):
    """Summaries of the scenarios of a demonstration, each as in its `summary.json`, and what they say together."""

    folder: Path
    """Holds the dataset, the model and a folder for each run."""

    def __init__(self, summaries: Sequence[dict[str, Any]], folder: Path) -> None:
        super().__init__(summaries)
        self.folder = folder

    @property
    def passed(self) -> bool:
        """Whether every run met the checks of its scenario."""
        return all(one["verdict"] == "pass" for one in self)

    @property
    def tracking(self) -> Mapping[str, ErrorFigures]:
        """How far the output was off the set-point, by the title of the scenario."""
        return {str(one["scenario"]): error_figures(one["tracking"]) for one in self}

    def __repr__(self) -> str:
        met = sum(one["verdict"] == "pass" for one in self)
        return f"<Demonstration in {self.folder}: {met} of {len(self)} runs met their checks>"

    def _repr_html_(self) -> str:
        rows = [
            [name, number(one.mean_abs, one.unit), number(one.max_abs, one.unit), str(summary["verdict"])]
            for summary, (name, one) in zip(self, self.tracking.items(), strict=True)
        ]
        headers = ["scenario", "mean absolute error", "largest error", "verdict"]
        return html_table(f"Demonstration in {self.folder}", headers, rows)


def demonstrate(
    device: PathText = "vo2_a", out: PathText = "out/demo", *, seed: int = 1, progress: Progress = False
) -> Demonstration:
    """Serve a simulated device, acquire, identify and run every bundled tracking scenario; return their summaries.

    Args:
        device: Plant file, or the name of a bundled one.
        out: Folder of the results.
        seed: Seed of the device's noise.
        progress: True prints each stage, a callable hears (text, None).
    """
    from rtctl.session.demo import demonstrate as internal

    name, folder, report = str(path_of("device", device)), path_of("out", out), reporter(progress)
    with stop_on_interrupt() as stop_requested:
        return Demonstration(internal(name, seed, folder, stop_requested, report.say), folder)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Latency:
    """Which period each driver holds on this machine."""

    ladders: Sequence[Ladder]
    """One a driver, with all periods that were tried."""
    reference: Histogram | None
    """Lateness by cyclictest; None: it is not installed."""

    @property
    def shown(self) -> list[tuple[Ladder, Rung]]:
        """Each driver at the shortest period that it holds, or at the longest one tried."""
        return [(ladder, ladder.held or ladder.rungs[0]) for ladder in self.ladders]

    @property
    def fastest_s(self) -> float:
        """The shortest period [s] among those shown."""
        return min(rung.period_s for _, rung in self.shown)

    @property
    def held(self) -> bool:
        """Whether every driver holds some period."""
        return all(ladder.held is not None for ladder in self.ladders)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of `latency.json`."""
        from rtctl.evaluation.metrics import finite
        from rtctl.session.latency_report import document

        content: dict[str, Any] = finite(document(self.ladders, self.reference))
        return content

    def save(self, folder: PathText) -> Path:
        """Write `latency.json` and `latency.png` into a folder."""
        from rtctl.evaluation.metrics import write_json

        target = path_of("folder", folder)
        target.mkdir(parents=True, exist_ok=True)
        write_json(target / "latency.json", self.to_dict(), "latency")
        if can_draw():
            self._draw(target / "latency.png")
        return target

    def _draw(self, path: Path) -> None:
        from rtctl.plots.latency import Curve, plot_latency

        curves = [(name_of(ladder, rung), rung.timing, rung.period_s) for ladder, rung in self.shown]
        plot_latency(
            path,
            [Curve(name, timing.lateness, period_s) for name, timing, period_s in curves],
            [Curve(name, timing.round_trip, period_s) for name, timing, period_s in curves],
            self.reference,
            "How late the loop wakes up and how long an exchange lasts",
        )

    def __repr__(self) -> str:
        return f"<Latency: {', '.join(name_of(ladder, rung) for ladder, rung in self.shown)}>"


def name_of(ladder: Ladder, rung: Rung) -> str:
    """Return driver and period for a person."""
    return f"{ladder.kind}, {1e3 * rung.period_s:g} ms"


def measure_latency(
    drivers: Sequence[str] = (),
    *,
    periods: Sequence[str] = (),
    duration: str = "2 s",
    priority: int | None = None,
    cpu: int | None = None,
    settings: Settings = (),
    progress: Progress = False,
) -> Latency:
    """Measure which period this machine and a wire hold: lateness, round trip, computing time.

    Args:
        drivers: Kinds such as "inprocess" or "modbus-tcp"; empty: all.
        periods: Such as "1 ms"; empty: 10 ms down to 0.1 ms, of instruments 50 ms down to 2 ms.
        duration: Of each period, such as "2 s".
        priority: SCHED_FIFO priority of the loop, 1 to 99, if permitted.
        cpu: The only CPU of the loop.
        settings: Keys of [driver] and [clock], such as the address of a device of your own.
        progress: True prints a line a period, a callable hears (text, None).

    Raises:
        InputError: A driver, a period or a key is wrong.
        RunError: A device failed.
    """
    from rtctl.scenario.schema import overridden
    from rtctl.session.latency import PERIODS_OF_KIND_S, PERIODS_S, cyclictest, known_kinds, measure

    kinds = list(drivers) or known_kinds()
    for kind in kinds:
        if kind not in known_kinds():
            raise InputError(f'driver: "{kind}" cannot be measured{nearest(str(kind), known_kinds())}')
    asked_s = [_seconds("period", text) for text in periods]
    duration_s, report = _seconds("duration", duration), reporter(progress)
    asked = {"priority": priority, "cpu": cpu, "lock_memory": priority is not None}
    clock = {key: value for key, value in asked.items() if value is not None}
    tables = overridden({"clock": clock}, override_texts(settings))
    with stop_on_interrupt() as stop:
        ladders = [
            measure(
                kind, tables, asked_s or PERIODS_OF_KIND_S.get(kind, PERIODS_S), duration_s, stop, report.say
            )
            for kind in kinds
        ]
    latency = Latency(ladders=ladders, reference=None)
    return Latency(ladders=ladders, reference=cyclictest(latency.fastest_s, duration_s, priority))


def _seconds(name: str, text: str) -> float:
    """Return a time [s] above 0. Raises InputError that names the option."""
    from rtctl.border.units.quantities import QUANTITY, parse_quantity

    number = QUANTITY.match(text.strip())
    if number is not None and not float(number[1]) > 0.0:
        raise InputError(f'{name} {text}: must be > 0 s; write one such as "1 ms"')
    try:
        value_s = parse_quantity(text, "s")
    except ValueError as error:
        raise InputError(f"{name}: {error}") from None
    return value_s
