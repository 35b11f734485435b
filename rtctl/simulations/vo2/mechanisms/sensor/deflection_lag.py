"""`sensor.deflection_lag`: y with time_constant y' = deflection - y is read instead of the deflection."""

from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient, heating_times
from rtctl.simulations.vo2.relaxation import lag


def lagging(read: Read, p: Values) -> Read:
    """Follow the deflection by a first-order lag, settled on the first value; it is linear between instants."""
    return read._replace(deflection=lag(read.deflection, read.steps_s, p["time_constant"]))


MECHANISM = Vo2Mechanism(
    id="sensor.deflection_lag",
    statement="The instrument that reads the deflection lags with a time constant of {time_constant}.",
    parameters=(
        coefficient(
            "time_constant", "s", "of the reading behind the beam", heating_times(5.0), low=0.0, high=1e3
        ),
    ),
    instrument=lagging,
    resolves=0.0625,
    stage=3,
)
