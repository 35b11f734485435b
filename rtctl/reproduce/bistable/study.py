"""`rtctl reproduce bistable`: the order of the steps."""

from rtctl.reproduce.bistable.steps.bias import bias
from rtctl.reproduce.bistable.steps.campaign import campaign
from rtctl.reproduce.bistable.steps.cost import cost
from rtctl.reproduce.bistable.steps.free_run import freerun
from rtctl.reproduce.bistable.steps.global_fit import globally
from rtctl.reproduce.bistable.steps.local_fit import local
from rtctl.reproduce.bistable.steps.orbits import orbits
from rtctl.reproduce.bistable.steps.outliers import outliers
from rtctl.reproduce.bistable.steps.portraits import portraits
from rtctl.reproduce.bistable.steps.selection import selection
from rtctl.reproduce.study import Step, Study

STUDY = Study(
    name="bistable",
    title="A bistable beam identified by regression: the study again, on a simulated shaker",
    paper="regression-based identification of a bistable magnetoelastic beam from 450 shaker records "
    "(HM, RM, RM5, RM5c)",
    lead="The paper's records are not public, so its protocol is played on a simulated beam whose truth is known: what "
    "a method gets right and wrong can be said in per cent of the truth, not only as agreement with a measurement. "
    "The paper's figures stand beside ours; where they differ the text says whether the beam, the method or the paper "
    "is the reason.",
    steps=(
        Step("campaign", campaign),
        Step("local", local),
        Step("global", globally),
        Step("bias", bias),
        Step("selection", selection),
        Step("freerun", freerun),
        Step("outliers", outliers),
        Step("orbits", orbits),
        Step("portraits", portraits),
        Step("cost", cost),
    ),
    faults=(
        "Equation (3) prints α = 4275.6 s⁻²; a beam with two wells needs −4275.6 (its own equation (2) says so).",
        "R² is of the acceleration that an equation predicts from measured states, not of a simulation: it says little "
        "of how far a simulated motion is from the measured one. Both are given here.",
    ),
)
