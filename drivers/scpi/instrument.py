"""One instrument at the end of a line: lines of text out and in, its identity, its error queue, its output.

SCPI has no numbers of requests: an answer belongs to the oldest question without one. After any fault the connection is
therefore given up, and the answer that may still come with it.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

from drivers.line_errors import lost
from drivers.scpi.answers import Reading, error_of, is_off, reading_of, shown
from drivers.scpi.ports import Place, Port
from drivers.scpi.table import PLACE, InstrumentTable
from rtctl.border.errors import DriverError, Fault, InputError

MOST_ERRORS = 30
"""Entries that are read of an error queue; the longest here has 30."""
LONGEST_LINE = 4096
MOST_ANSWERS = 30
"""Answers that are heard until one says that the output is off."""
LATE_S = 0.3
"""How long the identity is waited for after another answer [s]: one to an earlier program may come first."""


class Instrument:
    """An instrument with a table; every method but `close` and `switch_off` may raise DriverError."""

    def __init__(self, table: InstrumentTable, place: Place, setup_timeout_s: float) -> None:
        """Make an instrument that is not open.

        Args:
            table: what it understands.
            place: where it is reached.
            setup_timeout_s: time of an answer while it is set up [s]: a reset may take seconds.
        """
        self.table = table
        self.name = f"scpi {place.name} ({table.instrument.name})"
        self.identity = ""
        self._place, self._setup_timeout_s = place, setup_timeout_s
        self._port: Port | None = None
        self._arrived = b""
        self._timeout_s = setup_timeout_s

    @property
    def descriptor(self) -> int | None:
        """File descriptor of the open port; None: it has none."""
        return None if self._port is None else self._port.descriptor

    def open(self, setup: Sequence[str], timeout_s: float) -> None:
        """Connect, check the identity, send `commands.setup` and then `setup`, each followed by the error query.

        Args:
            setup: further commands.
            timeout_s: time of an answer after that [s].
        """
        self._timeout_s = self._setup_timeout_s
        try:
            self._port = self._place.connect(self._setup_timeout_s)
        except OSError as error:
            raise self._not_opened(error) from None
        self._arrived = b""
        self._identify()
        self.errors()  # those of an earlier program say nothing about what follows
        for command in (*self.table.commands.setup, *setup):
            self.command(command)
        self._timeout_s = timeout_s

    def settings(self, values: Mapping[str, float]) -> list[str]:
        """Return the commands that set `values`, by the names of `[commands]`. Raises InputError for one it has not."""
        texts = {name: getattr(self.table.commands, name) for name in values}
        for name, text in texts.items():
            if text is None:
                raise InputError(f"{self.name}: its table has no commands.{name}; leave {name} out")
        return [filled(texts[name], value) for name, value in values.items()]

    def command(self, text: str) -> None:
        """Send a command and read the error queue. Raises DriverError with what it says."""
        self.send(text)
        if errors := self.errors():
            raise DriverError(
                Fault.COMMAND_REFUSED,
                f"{self.name}: {shown(text)} was refused: {'; '.join(errors)}; correct the value, or the table",
            )

    def errors(self) -> list[str]:
        """Return the entries of the error queue, which is empty then; none where the table has no `next_error`."""
        found: list[str] = []
        query = self.table.commands.next_error
        while query is not None and len(found) < MOST_ERRORS:
            with self._named():
                entry = error_of(self.ask(query))
            if not entry:
                break
            found.append(entry)
        return found

    def ask(self, text: str) -> str:
        """Send a question and return its answer."""
        self.send(text)
        return self.answer(text)

    def send(self, *texts: str) -> None:
        """Send lines, all at once."""
        if self._port is None:
            raise DriverError(Fault.CONNECTION_LOST, f"{self.name}: is not open")
        try:
            self._port.send("".join(f"{text}\n" for text in texts).encode("ascii"))
        except OSError as error:
            raise lost(self.name, error, self._timeout_s) from None

    def reading(self) -> Reading:
        """Return the reading that was asked for."""
        text = self.answer(self.table.commands.read)
        with self._named():
            return reading_of(text, self.table.answer)

    def answer(self, question: str) -> str:
        """Return the next line."""
        line = self._line(time.monotonic() + self._timeout_s)
        if line is not None:
            return line
        begun = (
            f"only {shown(_text(self._arrived))} arrived, without an end of line"
            if self._arrived
            else "nothing came"
        )
        raise DriverError(
            Fault.NO_ANSWER,
            f"{self.name}: no answer to {shown(question)} within {1e3 * self._timeout_s:g} ms: {begun}; is it on, is "
            "the interface the right one, is the timeout longer than a reading takes?",
        )

    def switch_off(self, *commands: str) -> bool:
        """Send `commands`, of which the last asks for the output; return whether it is said to be off. Never raises."""
        deadline_s = time.monotonic() + self._setup_timeout_s
        try:
            self.send(*commands)
            for _ in range(MOST_ANSWERS):
                line = self._line(deadline_s)
                if line is None:
                    return False
                if is_off(line):
                    return True
                self.send(
                    commands[-1]
                )  # that may have been the answer to an older question, or the rest of one
        except DriverError:
            pass
        return False

    def close(self) -> None:
        """Disconnect. Never raises."""
        if self._port is not None:
            self._port.close()
        self._port = None

    def _not_opened(self, error: OSError) -> DriverError:
        if error.errno is None and str(error) and not isinstance(error, TimeoutError):  # of the VISA library
            what = f"cannot be opened: {error}; are resource and library right?"
            return DriverError(Fault.CONNECTION_LOST, f"{self.name}: {what}")
        return lost(self.name, error, self._setup_timeout_s)

    def _identify(self) -> None:
        """Ask for the identity and believe the first answer that fits; others may be to an earlier program."""
        question, heard = self.table.commands.identify, ""
        self.send(question)
        deadline_s = time.monotonic() + self._setup_timeout_s
        while (line := self._line(deadline_s)) is not None:
            if self.table.fits(line):
                self.identity = ",".join(part.strip() for part in line.split(",")[:3])
                return
            heard = line
            deadline_s = min(deadline_s, time.monotonic() + LATE_S)
        if not heard:
            self.answer(question)  # raises, with what came instead
        raise DriverError(
            Fault.COMMAND_REFUSED,
            f"{self.name}: its identity is {shown(heard)}, the table {self.table.instrument.name} is for "
            f"{shown(self.table.instrument.identity)}; choose another driver.table, or correct the address",
        )

    def _line(self, deadline_s: float) -> str | None:
        """Return the next line without its end; None: none is whole at the deadline."""
        if self._port is None:
            raise DriverError(Fault.CONNECTION_LOST, f"{self.name}: is not open")
        while b"\n" not in self._arrived and len(self._arrived) < LONGEST_LINE:
            try:
                data = self._port.receive(deadline_s)
            except OSError as error:
                raise lost(self.name, error, self._timeout_s) from None
            if not data:
                return None
            self._arrived += data
        line, _, self._arrived = self._arrived.partition(b"\n")
        return _text(line)

    def _named(self) -> _Named:
        return _Named(self.name)


class _Named:
    """A block whose faults get the name of the instrument in front."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __enter__(self) -> None: ...

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, DriverError) and not str(error).startswith(self._name):
            raise DriverError(error.fault, f"{self._name}: {error}") from None


def filled(text: str, value: float) -> str:
    """Return a command with its number in it [A or V]."""
    return text.replace(PLACE, f"{value:.12g}")


def _text(data: bytes) -> str:
    return data.decode("ascii", "replace").strip("\r\n \x00")
