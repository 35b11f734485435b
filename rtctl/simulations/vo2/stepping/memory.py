"""What a VO2 model remembers from one step to the next; all of it is reals."""

from __future__ import annotations

from rtctl.hysteresis.preisach.model import MAX_EXTREMA
from rtctl.simulations.vo2.mechanisms.hysteresis.creep import A_DECADE, DECADES
from rtctl.translation.types import REAL, ArrayType, Field, RecordType

STACK = 1 + 2 * MAX_EXTREMA
RELAXATIONS = 1 + A_DECADE * DECADES


def memory_record(kept: int) -> RecordType:
    """Return the record of the memory, with room for some communication steps of the current."""
    return RecordType(
        "memory",
        (
            Field("begun", REAL, 0, "1 once a step was done"),
            Field("fault", REAL, 0, "0: none; see `march`"),
            Field("time_s", REAL, 0, "of the last instant [s]"),
            Field("since_s", REAL, 0, "since the last instant whose readings are kept [s]"),
            *_current(kept),
            *_heat(),
            *_read_outs(),
            *_readings(),
        ),
    )


def _current(kept: int) -> tuple[Field, ...]:
    return (
        Field("first", REAL, 0, "command before the first step [mA]"),
        Field("count", REAL, 0, "communication steps so far"),
        Field("begins_s", ArrayType(), kept, "begin of each of the last communication steps [s]"),
        Field("levels", ArrayType(), kept, "command at its begin [mA]"),
        Field("slopes", ArrayType(), kept, "its slope [mA/s]"),
        Field("backlash", REAL, 0, "command behind the backlash [mA]"),
        Field("kept", REAL, 0, "command without small changes [mA]"),
        Field("current", REAL, 0, "heating current [mA]"),
    )


def _heat() -> tuple[Field, ...]:
    return (
        Field("main", REAL, 0, "T_1 [mA^2]"),
        Field("second", REAL, 0, "T_2 [mA^2]"),
        Field("T", REAL, 0, "T by its heat alone [mA^2]"),
        Field("capacity", REAL, 0, "of the film, over its own without phase"),
        Field("stored", REAL, 0, "heat of the phase [mA^2]"),
        Field("phase", REAL, 0, "share of the film that has changed"),
        Field("warm", REAL, 0, "T in a room that drifts [mA^2]"),
        Field("late", REAL, 0, "what lagging relays see of it [mA^2]"),
        Field("heat_film", ArrayType(), STACK, "relays of -ln R at T"),
        Field("heat_beam", ArrayType(), STACK, "relays of the deflection at T"),
    )


def _read_outs() -> tuple[Field, ...]:
    return (
        Field("power", REAL, 0, "surrogate [mA^2]"),
        Field("lagging", REAL, 0, "surrogate for the relays [mA^2]"),
        Field("turn", ArrayType(), 2, "where a backlash that the loops hold turned last [mA], and its way"),
        Field("film", ArrayType(), STACK, "relays of -ln R"),
        Field("beam", ArrayType(), STACK, "relays of the deflection"),
    )


def _readings() -> tuple[Field, ...]:
    return (
        Field("centre", REAL, 0, "of the play that tells heating from cooling"),
        Field("film_share", REAL, 0, "switched share of the film, of the instant before"),
        Field("beam_share", REAL, 0, "switched part of the deflection [um]"),
        Field("film_creep", ArrayType(), RELAXATIONS, "what each relaxation of the film lacks"),
        Field("beam_creep", ArrayType(), RELAXATIONS, "what each relaxation of the beam lacks [um]"),
        Field("bent", REAL, 0, "deflection of a beam without mass, of the instant before [um]"),
        Field("swing", REAL, 0, "q [um]"),
        Field("speed", REAL, 0, "q' [um/s]"),
        Field("ohm", REAL, 0, "resistance at a lagging sensor, of the instant before [ohm]"),
        Field("ohm_missed", REAL, 0, "by which it lags [ohm]"),
        Field("seen", REAL, 0, "deflection at a lagging instrument, of the instant before [um]"),
        Field("seen_missed", REAL, 0, "by which it lags [um]"),
        Field("coupled", REAL, 0, "deflection at an AC-coupled instrument, of the instant before [um]"),
        Field("coupled_missed", REAL, 0, "by which its slow part lags [um]"),
        Field("coupled_first", REAL, 0, "its first deflection [um]"),
        Field("resistance", REAL, 0, "as it is read [ohm]"),
        Field("deflection", REAL, 0, "as it is read [um]"),
    )
