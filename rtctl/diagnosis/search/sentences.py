"""Sentences of an answer about how the search went."""

STOPPED = (
    "stopped by the user after {} fits: no cause is claimed; residual, location and isolability are those of the "
    "refitted nominal model"
)
LOOPS_NOT_REFITTED = (
    "stopped by the user before the static loops were refitted behind these causes: their values may absorb an error "
    "of the loops"
)
LOOPS_NOT_CHECKED = (
    "stopped by the user before the static loops were checked: hysteresis.shape may act as well"
)
FURTHER_NOT_SEARCHED = (
    "stopped by the user before further causes were searched behind the static loops that were refitted"
)
UNSUPPORTED = (
    "{} would remove little beside the rest and lowers the error on the test records by less than half a percent, "
    "or not at all: not named"
)
MINOR = (
    "{} would remove less than is left with all causes, or nothing on test records, and may only take up a part of "
    "what is missing: not named"
)
IMITATING = (
    "{} would be a second law of dissipation in a set that does not explain everything, and a free curve of the speed "
    "in its place leaves clearly less, so the two imitate another law: the one that removes most is kept, and this is "
    "not named"
)
IMITATION_NOT_TRIED = (
    "stopped by the user before a free curve of the speed was compared with the laws of dissipation: two of them may "
    "imitate another one"
)
OUT_OF_WORK = (
    "the search used up its budget of {:.6g} million simulated steps and reports the best set found by then; further "
    "sets of causes were not tried: a larger budget (--work) tries them"
)
CUT_BY_CLOCK = (
    "the wall-clock guard ended the search after {:.0f} s, before its work budget was used up, so this answer depends "
    "on the speed of the machine; a longer guard (--seconds) avoids that"
)
