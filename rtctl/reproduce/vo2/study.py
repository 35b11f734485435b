"""The study: steps in the order of the paper's figures, and the paper's errors."""

from __future__ import annotations

from rtctl.reproduce.study import Step, Study
from rtctl.reproduce.vo2 import paper
from rtctl.reproduce.vo2.steps import (
    beyond,
    excitation,
    frequency,
    identification,
    levels,
    random_current,
    rate,
    tracking,
)

STUDY = Study(
    name="vo2",
    title="A composite hysteresis model in self-sensing feedback of a VO2 microactuator",
    paper=paper.REFERENCE,
    lead=(
        "The paper has one real device; here are three simulated ones, whose physics the estimators do not share: "
        "vo2_a (domains after the paper's figures), vo2_b (another film, mixing law, offset, room and time constant) "
        "and vo2_l2p (the limiting-loop-proximity model, whose minor loops do not close). Being simulated they lack "
        "what nobody has modelled yet: read our errors as what a method leaves, not as what a bench will show. "
        "Percentages are of each device's identified range of deflection, the paper's of its 57.03 um.\n\n"
        "Seeds: device noise in runs 21 to 25, which also draw the random currents, each on a model of its own "
        "identification with noise 902 to 906. The constants of observer and controller were chosen on vo2_a with "
        "noise seed 5, before these seeds were ever run; that the multisines want feedforward was seen on all three "
        "devices, with other seeds."
    ),
    steps=(
        Step("excitation", excitation.compute),
        Step("frequency", frequency.compute),
        Step("identification", identification.compute),
        Step("levels", levels.compute),
        Step("random_current", random_current.compute),
        Step("tracking", tracking.compute),
        Step("beyond", beyond.compute),
        Step("rate", rate.compute),
    ),
    faults=(
        "Equation (11) has no minus: tried on the weights of table I, the inverse as printed is off by twice the "
        "range, with the minus by rounding (section on identification).",
        "The abstract gives the GPI to deflection and the EGPI to resistance; equations (13) and (15) have it the "
        "other way round, which is what can be inverted and what we build.",
        "Equation (13) takes resistance rising with temperature (envelopes that rise, weights of table I that are "
        "not negative); the film's falls. We model -R.",
        "Equation (14) holds the temperature where the reading does not change: noise sees to it that it always does. "
        "It is also a right inverse only: between the two envelopes every temperature gives the same reading, and "
        "the branch is a guess.",
        "The range of deflection is [48.13, 72.15] um in section II and [1.62, 58.65] um twice in section IV; "
        "references about 30 um fit the second alone, over which all percentages here are taken.",
        "The abstract's references are 1 Hz, and 10 and 30 Hz; the text's are 0.1 Hz, and 1 and 10 Hz. All are run.",
        "Signs of b in tables I and II are lost: 7.21 mA (heating) and 6.61 mA (cooling) come out for the first play "
        "only with b negative. Most of a, the envelopes of table I and the gains of the PI are lost altogether.",
        "Two envelopes of table II have their centres at 13.73 and 14.21 mA, outside the device's 3.68 to 8.49 mA.",
        "The EGPI is said not to be adopted for the control experiments; figures 15 and 16 are said to show three "
        "self-sensing approaches. No figure of its tracking is given.",
        "Mild rate dependence of D–R is put down to the cantilever's structural dynamics: of a beam with its first "
        "mode at some 7.5 kHz they are 2e-5 of the deflection at 30 Hz (section on frequency).",
    ),
)
