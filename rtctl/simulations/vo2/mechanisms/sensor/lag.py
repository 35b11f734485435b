"""`sensor.lag`: y with time_constant y' = R - y is read instead of R."""

from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient, heating_times
from rtctl.simulations.vo2.relaxation import lag


def lagging(read: Read, p: Values) -> Read:
    """Follow the resistance by a first-order lag, settled on the first value; R is linear between instants."""
    return read._replace(resistance=lag(read.resistance, read.steps_s, p["time_constant"]))


MECHANISM = Vo2Mechanism(
    id="sensor.lag",
    statement="The resistance reading lags with a time constant of {time_constant}.",
    parameters=(
        coefficient(
            "time_constant", "s", "of the reading behind the film", heating_times(5.0), low=0.0, high=1e3
        ),
    ),
    instrument=lagging,
    resolves=0.0625,
    stage=3,
)
