"""`timing.skew`: readings are taken at another instant than their rows say; one signal's, or late those of both.

Both early by the same time would be `actuation.delay`, which is that law's name.
"""

from rtctl.simulations.vo2.mechanism import Values, Vo2Mechanism, coefficient, heating_times

SCALE_S = heating_times(2.0)


def read_at(p: Values) -> tuple[float, float]:
    """Return by how much [s] resistance and deflection are read after their rows' instants."""
    return p["late"] + p["resistance"], p["late"] + p["deflection"]


MECHANISM = Vo2Mechanism(
    id="timing.skew",
    statement=(
        "Rows are read {late} after their instants, resistance {resistance} and deflection {deflection} later."
    ),
    parameters=(
        coefficient(
            "late", "s", "from the row's instant to the reading of both signals", SCALE_S, default=0.0, low=0.0,
            high=10.0,
        ),
        coefficient(
            "resistance", "s", "by which the resistance is read later, below 0 where it is read earlier", SCALE_S,
            default=0.0, low=-10.0, high=10.0,
        ),
        coefficient(
            "deflection", "s", "by which the deflection is read later, below 0 where it is read earlier", SCALE_S,
            default=0.0, low=-10.0, high=10.0,
        ),
    ),
    forms={
        "late": "Both readings of a row are taken {late} after the row's instant.",
        "resistance": "The resistance of a row is read {resistance} after the row's instant (below 0: before it).",
        "deflection": "The deflection of a row is read {deflection} after the row's instant (below 0: before it).",
    },
    reads_at=read_at,
)  # fmt: skip
