"""`thermal.latent_heat`: tau (T + heat phi)' = P - T, phi the phase fraction, that of the deflection's relays."""

from rtctl.simulations.vo2.mechanism import Balance, Values, Vo2Mechanism, coefficient, power_of


def held(balance: Balance, p: Values) -> Balance:
    """Heat that the transition takes up and gives back."""
    return balance._replace(latent=p["heat"])


MECHANISM = Vo2Mechanism(
    id="thermal.latent_heat",
    statement="The transition takes up latent heat of {heat}: the film is slower while its phase changes.",
    parameters=(
        coefficient(
            "heat", "mA^2", "of the whole transition, as surrogate power", power_of, low=0.0
        ),
    ),
    balance=held,
)  # fmt: skip
