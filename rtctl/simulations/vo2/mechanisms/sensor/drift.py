"""`sensor.drift`: D + rate t is read, t since the record's first sample; the resistance's drift is `sensor.ageing`."""

from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient


def drifting(read: Read, p: Values) -> Read:
    """Move the zero of the deflection reading."""
    return read._replace(deflection=read.deflection + p["rate"] * read.time_s)


MECHANISM = Vo2Mechanism(
    id="sensor.drift",
    statement="The deflection reading drifts by {rate} from the start of each record.",
    parameters=(
        coefficient("rate", "um/s", "of the reading's zero", lambda s: s.excursion / s.duration),
    ),
    instrument=drifting,
    stage=5,
    slow=True,
)  # fmt: skip
