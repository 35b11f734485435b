"""`sensor.deflection_lag`: y with time_constant y' = deflection - y is read instead of the deflection."""

from rtctl.simulations.vo2.mechanism import TYPICAL_TIME_S, Read, Values, Vo2Mechanism, coefficient
from rtctl.simulations.vo2.relaxation import lag


def lagging(read: Read, p: Values) -> Read:
    """Follow the deflection by a first-order lag, settled on the first value; it is linear between instants."""
    return read._replace(deflection=lag(read.deflection, read.steps_s, p["time_constant"]))


MECHANISM = Vo2Mechanism(
    id="sensor.deflection_lag",
    statement="The instrument that reads the deflection lags with a time constant of {time_constant}.",
    parameters=(
        coefficient(
            "time_constant", "s", "of the reading behind the beam", 5.0 * TYPICAL_TIME_S, low=0.0, high=10.0
        ),
    ),
    instrument=lagging,
    resolves_s=lambda p: 0.0625 * TYPICAL_TIME_S,
    stage=3,
)
