"""`thermal.phase_heating`: the power is i^2 (1 + growth phi), phi the phase fraction that the resistance's relays show.

The metallic film takes up more, or less, of the heating than the cold one. With its steady effect known to the loops
it makes the film slower while phi changes, as a latent heat of growth times the power does; a loop over the current
cannot hold all of it, as phi follows the branch.
"""

from rtctl.simulations.vo2.mechanism import Balance, Values, Vo2Mechanism, coefficient, known


def growing(balance: Balance, p: Values) -> Balance:
    """Make the heating depend on the phase."""
    return balance._replace(phase_heating=p["growth"], phase_heating_known=p["known"] * p["growth"])


MECHANISM = Vo2Mechanism(
    id="thermal.phase_heating",
    statement="The heating grows by {growth} of itself as the film turns metallic.",
    parameters=(
        coefficient("growth", "dimensionless", "of the metallic film's heating over the cold film's", 0.3, low=-0.5),
        known(also=(0.0,)),
    ),
    balance=growing,
)  # fmt: skip
