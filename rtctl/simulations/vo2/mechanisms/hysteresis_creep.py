"""`hysteresis.creep`: phi + rate sum_j (z_j - phi), onset 10^j z_j' = phi - z_j, j = 0 ... 3, phi what the relays make.

After a change of temperature the phase fraction creeps on by `rate` of its change a decade of time, from `onset`.
The sum of relaxations at equal logarithmic distances is Kuhnen and Janocha's creep operator of log t type.
"""

from rtctl.simulations.vo2.mechanism import FloatArray, Read, Values, Vo2Mechanism, coefficient, shape
from rtctl.simulations.vo2.relaxation import lag

DECADES = 4


def creeping(read: Read, p: Values) -> Read:
    """Both read-outs creep, each with its own relays."""

    def missing(relays: FloatArray) -> FloatArray:
        each = (lag(relays, read.steps_s, p["onset"] * 10.0**j) for j in range(DECADES))
        return p["rate"] * (sum(each) - DECADES * relays)

    return read._replace(
        reading=read.reading + missing(read.resistance_relays),
        deflection=read.deflection + missing(read.deflection_relays),
    )


MECHANISM = Vo2Mechanism(
    id="hysteresis.creep",
    statement="At constant temperature the transition creeps on, by {rate} of its change a decade of time.",
    parameters=(
        coefficient("rate", "dimensionless", "of the change, a decade", 0.05, low=-0.2, high=0.25),
        shape("onset", "s", "of the first decade", 0.01, default=0.01, low=1e-5, high=1e3, shape_range=(0.03, 100.0)),
    ),
    film=creeping,
)  # fmt: skip
