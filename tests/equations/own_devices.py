"""Devices as classes, each beside the expressions that say the same."""

import math

import numpy as np

GRAVITY = 981.0
CURVE = np.array([0.0, 0.8, 1.0])


def falling(level):
    return math.sqrt(2.0 * GRAVITY * max(level, 0.0))


class Tanks:
    inputs = {"pump": "V"}
    states = {"upper": {"unit": "cm", "initial": 3.0, "low": 0}, "lower": {"unit": "cm", "initial": 3.0}}
    outputs = {"reading": "V"}
    parameters = {
        "gain": {"value": 1.8, "unit": "cm/min/V"},
        "hole": {"value": 1.2e-3, "unit": "1"},
        "outlet": {"value": 1.0e-3, "unit": "1"},
        "scale": {"value": 2.0, "unit": "V/dm", "fixed": True},
    }
    device = {"outputs": {"reading": {"noise": 0.001, "low": 0.0, "high": 2.0}}}

    def rates(upper, lower, pump, gain, hole, outlet):
        out = hole * falling(upper)
        return gain * pump / 60.0 - out, out - outlet * falling(lower)

    @staticmethod
    def readings(lower, scale):
        return scale * lower / 10.0


TANKS = """
[model]
kind = "equations"
[model.inputs]
pump = { unit = "V" }
[model.states]
upper = { unit = "cm", rate = "gain*pump - out", initial = 3.0, low = 0 }
lower = { unit = "cm", rate = "out - outlet*sqrt(2*g*max(lower, 0))", initial = 3.0 }
[model.terms]
out = "hole*sqrt(2*g*max(upper, 0))"
[model.outputs]
reading = { unit = "V", value = "scale*lower" }
[model.parameters]
gain = { value = 1.8, unit = "cm/min/V" }
hole = { value = 1.2e-3, unit = "1" }
outlet = { value = 1.0e-3, unit = "1" }
scale = { value = 2.0, unit = "V/dm", fixed = true }
g = { value = 981.0, unit = "cm/s^2", fixed = true }
"""


class Fast:
    """A fast part, for which steps are implicit, and a table of the module."""

    inputs = {"u": "V"}
    states = {"x": "V", "y": "V"}
    outputs = {"y": "V"}
    parameters = {"fast": {"value": 2e4, "unit": "1/s"}}

    def rates(x, y, u, fast):
        return fast * (u - x), CURVE[1] * (x - y)


FAST = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "V" }
[model.states]
x = { unit = "V", rate = "fast*(u - x)" }
y = { unit = "V", rate = "slow*(x - y)" }
[model.outputs]
y = { unit = "V", value = "y" }
[model.parameters]
fast = { value = 2e4, unit = "1/s" }
slow = { value = 0.8, unit = "1/s", fixed = true }
"""


class WithSelf(Tanks):
    def rates(self, upper, lower, pump):
        return upper, lower


class Misspelt(Tanks):
    def rates(upper, lower, pmup):
        return upper, lower


class TooFew(Tanks):
    def rates(upper, lower, pump):
        return upper


class NotCompiled(Tanks):
    def rates(upper, lower, pump):
        return open(upper), lower


class WithDefault(Tanks):
    def rates(upper, lower, pump=1.0):
        return upper, lower


class WithoutRates:
    states = {"x": "V"}
    outputs = {"z": "V"}
