"""`thermal.latent_heat`: tau (T + heat phi)' = P - T, phi the phase fraction, that of the relays of the two read-outs.

A film's electrical transition and its structural one need not be at one temperature: `film` is the share of the heat
that goes with the resistance's relays, the rest with the deflection's.
"""

from rtctl.simulations.vo2.mechanism import Balance, Values, Vo2Mechanism, coefficient, power_of, shape


def held(balance: Balance, p: Values) -> Balance:
    """Add the heat that the transition takes up and gives back."""
    return balance._replace(latent=(1.0 - p["film"]) * p["heat"], film_heat=p["film"] * p["heat"])


MECHANISM = Vo2Mechanism(
    id="thermal.latent_heat",
    statement="The transition takes up latent heat of {heat}: the film is slower while its phase changes.",
    parameters=(
        coefficient(
            "heat", "mA^2", "of the whole transition, as surrogate power", power_of, low=0.0
        ),
        shape(
            "film", "dimensionless", "share of it that goes with the resistance's transition", 1.0, default=0.0,
            low=0.0, high=1.0, shape_range=(0.0, 1.0), also=(1.0,),
        ),
    ),
    balance=held,
)  # fmt: skip
