"""Process variables on a Channel Access server in a thread of its own.

It serves this machine only, unless EPICS' own variable EPICS_CAS_INTF_ADDR_LIST names other interfaces: Channel Access
knows no password, so who reaches the port can read, and write what may be written. Reference: EPICS Channel Access
protocol specification; caproto, https://caproto.github.io.
"""

from __future__ import annotations

import asyncio
import logging
import math
import os
import socket
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rtctl.border.errors import InputError, RtctlError
from rtctl.extras import require

LOOPBACK = "127.0.0.1"
INTERFACES, PORT = "EPICS_CAS_INTF_ADDR_LIST", "EPICS_CA_SERVER_PORT"
QUIET = {"EPICS_CAS_AUTO_BEACON_ADDR_LIST": "NO", "EPICS_CAS_BEACON_ADDR_LIST": LOOPBACK}
"""Where the server tells that it is there, while it serves this machine alone."""
LONGEST_TEXT = 500
DIGITS = 6
"""Digits behind the point in which a client shows a number."""
START_WITHIN_S = 20.0

Setter = Callable[[str, float], str]
"""`set(parameter, value)`: change the run; returns what was changed in words, raises RtctlError with what is wrong."""


class ChannelAccess:
    """The server and its variables; all methods are for one thread, which never waits for a client."""

    def __init__(self, prefix: str, setter: Setter | None) -> None:
        """Start to serve.

        Args:
            prefix: What every name begins with.
            setter: Is asked for each change by a client, in a thread of its own; None: nothing can be written.

        Raises:
            InputError: caproto is missing, or EPICS' variables name what is not of this machine.
        """
        require("caproto", "--epics")
        check_interfaces(os.environ.get(INTERFACES, ""))
        logging.getLogger("caproto").setLevel(
            logging.CRITICAL
        )  # a refused value is no failure of this program
        self._prefix, self._setter = prefix, setter
        self._variables: dict[str, Any] = {}
        """By their whole name, as the server looks them up."""
        self._loop = asyncio.new_event_loop()
        self._ready, self._error = threading.Event(), ""
        self._task: asyncio.Task[Any] | None = None
        self._before = {name: os.environ.get(name) for name in QUIET}
        if not os.environ.get(INTERFACES):
            os.environ.update(QUIET)
        self._thread = threading.Thread(target=self._serve, name="epics", daemon=True)
        self._thread.start()
        self._ready.wait(START_WITHIN_S)
        if self._error:
            self.close()
            raise InputError(f"--epics: cannot serve: {self._error}; {PORT} names another port")

    def offer(
        self,
        numbers: Sequence[tuple[str, str]],
        texts: Sequence[str] = (),
        settable: Mapping[str, str] | None = None,
    ) -> None:
        """Add variables that are not there yet.

        Args:
            numbers: Names and units.
            texts: Names.
            settable: Parameter of the run that a variable sets, by name of the variable.
        """
        from rtctl.live_page.streams import channels

        set_by = {} if settable is None or self._setter is None else settable
        for name, unit in numbers:
            whole = self._prefix + name
            if whole not in self._variables:
                ask = self._asked(set_by[name]) if name in set_by else None
                self._variables[whole] = channels.number(unit, DIGITS, ask)
        for name in texts:
            self._variables.setdefault(self._prefix + name, channels.text(LONGEST_TEXT))

    def publish(self, numbers: Mapping[str, float], texts: Mapping[str, str]) -> None:
        """Give variables new values; what has not changed is not sent."""
        self._soon(self._write({**numbers, **texts}))

    def invalidate(self) -> None:
        """Mark all numbers as not known."""
        names = [name for name, one in self._variables.items() if isinstance(one.value, float)]
        self._soon(self._write({name.removeprefix(self._prefix): math.nan for name in names}))

    def close(self) -> None:
        """Serve no more."""
        if self._thread.is_alive():
            assert self._task is not None
            self._loop.call_soon_threadsafe(self._task.cancel)
            self._thread.join()
        for name, value in self._before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value

    def _soon(self, what: Any) -> None:
        asyncio.run_coroutine_threadsafe(what, self._loop)

    async def _write(self, values: Mapping[str, float | str]) -> None:
        from rtctl.live_page.streams import channels

        for name, value in values.items():
            await channels.publish(self._variables[self._prefix + name], value)

    def _asked(self, parameter: str) -> Callable[[float], Any]:
        async def ask(value: float) -> None:
            assert self._setter is not None
            try:
                said = await asyncio.to_thread(self._setter, parameter, value)
            except RtctlError as error:
                await self._write({"message": str(error)})
                raise
            await self._write({"message": said})

        return ask

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._run())
        finally:
            self._ready.set()
            self._loop.close()

    async def _run(self) -> None:
        from rtctl.live_page.streams import channels

        named = os.environ.get(INTERFACES)
        self._task = asyncio.current_task()

        async def started(layer: object) -> None:
            self._ready.set()

        try:
            await channels.Server(self._variables, None if named else [LOOPBACK]).run(startup_hook=started)
        except asyncio.CancelledError:
            pass
        except Exception as error:  # whatever caproto lets out: it is told, the page goes on without
            self._error = str(error) or type(error).__name__


def check_interfaces(addresses: str) -> None:
    """Raise InputError where one of the addresses in EPICS' variable is none of this machine."""
    for address in addresses.split():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried:
            try:
                tried.bind((address.partition(":")[0], 0))
            except OSError as error:
                raise InputError(
                    f"--epics: {INTERFACES} = {addresses}: {address} is no address of this machine "
                    f"({error.strerror or error}); leave the variable out to serve this machine only"
                ) from None
