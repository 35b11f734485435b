"""Runge-Kutta of order 4 at a fixed step for many lanes, written out for the states and inputs of a model.

Lanes are the innermost loop, so that the compiler works on several at once. States are plain variables: as tuples they
took 1.8 times as long a step and four times as long to compile (measured). A state that is at a limit when a step
begins, and whose rate points beyond it, stays there for the step; one that a step brings beyond a limit is put back.

Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1, table 1.2.
"""

from __future__ import annotations

import math

from plant_sim.equations.compiled.source import kept, law_source, numbers_source
from plant_sim.equations.system import System

STEP = """\
def rk4(x, nodes, h, substeps, start_s, p, out{arguments}):
    lanes = x.shape[1]
    half, sixth = 0.5 * h, h / 6.0
    row, until_sample = 1, substeps
{prepare}    for i in range(nodes.shape[1]):
{inputs}
        t = start_s + i * h
{begin}        for j in range(lanes):
{load}
            {k1} = rates({x}, {u1}t, p, j)
{held}{a}            {k2} = rates({x2}, {u2}t + half, p, j)
{b}            {k3} = rates({x3}, {u2}t + half, p, j)
{c}            {k4} = rates({x4}, {u4}t + h, p, j)
{d}{step}
{events}        until_sample -= 1
        if until_sample == 0:
            until_sample = substeps
            for j in range(lanes):
{sample}
            row += 1
    return True
"""
"""March all lanes through a record.

x: states (states, lanes) at the start, left at the end [SI]. nodes: inputs (3, steps, inputs) at the start, middle and
end of each step [SI]. h: step [s]. substeps: steps between two samples. start_s: time at the start [s]. p: parameters
(parameters, lanes) [SI]. out: states (samples, states, lanes), whose row 0 is left to the caller. Returns False where
events do not end; further arguments are those of `plant_sim.equations.compiled.crossing.carry`.
"""


ARGUMENTS = ", low, high, side, law, watched, resets, directions, move, carry, endless"
PREPARE = """\
    past, passed = np.empty((x.shape[0], lanes)), np.empty(lanes, dtype=np.int64)
    here, own = np.empty(x.shape[0]), make_scratch(x.shape[0], nodes.shape[2], side.shape[0])
"""
BEGIN = """\
        changed = 0
        for j in range(lanes):
{keep}
"""
EVENTS = """\
        for j in range(lanes):
            {guards} = guards({moved}, {u4}t + h, p, j)
            passed[j] = 1 if {passing} else 0
            changed += passed[j]
        if changed > 0:
            for j in range(lanes):
                if passed[j] == 1:
                    for r in range(x.shape[0]):
                        here[r] = past[r, j]
                    one = Step(nodes, i, h, t, p, j, low, high, False)
                    if carry(law, watched, resets, directions, move, one, own, side, here, endless) == 0:
                        return False
                    for r in range(x.shape[0]):
                        x[r, j] = here[r]
"""
"""What a model with events has besides: lanes in which an expression is no longer on its side go through the step again
by `plant_sim.equations.compiled.crossing`, the others are done with. In one loop with the step itself, the compiler
would no longer work on several lanes at once."""


def rates_source(system: System) -> str:
    """Return the source of the law `rates(x0, ..., u0, ..., t, p, j) -> (rate0, ...)`."""
    return law_source(system, f"def rates({_arguments(system)}):\n", "return ({rates},)", limited=False)


def noticing_source(system: System) -> str:
    """Return the source of `guards(x0, ..., u0, ..., t, p, j) -> (number0, ...)`, what the events watch; "" without."""
    watched = tuple(one.when for one in system.events)
    head = f"def guards({_arguments(system)}):\n"
    return numbers_source(system, watched, head, "return ({numbers},)") if watched else ""


def _parts_of_events(system: System, moved: str, inputs: str) -> dict[str, str]:
    """Return the parts of the source for events, from the states after a step and the inputs there; "" without any."""
    if not system.events:
        return dict.fromkeys(("arguments", "prepare", "begin", "events"), "")
    events = range(len(system.events))
    made = EVENTS.format(
        guards="".join(f"g{e}, " for e in events), moved=moved, u4=inputs,
        passing=" | ".join(f"(side[{e}, j] * g{e} <= 0.0)" for e in events),
    )  # fmt: skip
    keep = "\n".join(f"            past[{k}, j] = x[{k}, j]" for k in range(len(system.states)))
    return {
        "arguments": ARGUMENTS,
        "prepare": PREPARE,
        "begin": BEGIN.format(keep=keep),
        "events": made,
    }


def _arguments(system: System) -> str:
    states = [f"x{k}" for k in range(len(system.states))]
    return ", ".join([*states, *(f"u{k}" for k in range(len(system.inputs))), "t", "p", "j"])


def rk4_source(system: System) -> str:
    """Return the source of the integrator, which calls `rates`."""
    states, inputs = range(len(system.states)), range(len(system.inputs))

    def lines(indent: int, made: list[str]) -> str:
        return "\n".join(" " * indent + line for line in made)

    def each(form: str) -> str:
        return ", ".join(form.format(k=k) for k in states)

    def at(node: int) -> str:
        return "".join(f"v{node}_{k}, " for k in inputs)

    limits = [
        (f"{side}{k}", k, f"{sign} 0.0", f"x{k} {sign}= {limit!r}")
        for k, one in enumerate(system.states)
        for side, sign, limit in (("low", "<", one.low), ("high", ">", one.high))
        if math.isfinite(limit)
    ]
    held = [f"{name} = {reached} and a{k} {outward}" for name, k, outward, reached in limits]

    def kept_rates(rate: str) -> str:
        made = [
            f"{rate}{k} = 0.0 if {name} and {rate}{k} {outward} else {rate}{k}"
            for name, k, outward, _ in limits
        ]
        return lines(12, made) + "\n" if made else ""

    total = "x{k} + sixth * (a{k} + 2.0 * (b{k} + c{k}) + d{k})"
    return STEP.format(
        inputs=lines(8, [f"v{n}_{k} = nodes[{n}, i, {k}]" for n in range(3) for k in inputs] or ["pass"]),
        load=lines(12, [f"x{k} = x[{k}, j]" for k in states]),
        k1=each("a{k}") + ",", k2=each("b{k}") + ",", k3=each("c{k}") + ",", k4=each("d{k}") + ",",
        x=each("x{k}"), x2=each("x{k} + half * a{k}"), x3=each("x{k} + half * b{k}"), x4=each("x{k} + h * c{k}"),
        u1=at(0), u2=at(1), u4=at(2),
        held=lines(12, held) + "\n" if held else "",
        a=kept_rates("a"), b=kept_rates("b"), c=kept_rates("c"), d=kept_rates("d"),
        step=lines(12, [
            line
            for k, state in enumerate(system.states)
            for line in (f"y{k} = {total.format(k=k)}", f"x[{k}, j] = {kept(state, f'y{k}')}")
        ]),
        sample=lines(16, [f"out[row, {k}, j] = x[{k}, j]" for k in states]),
        **_parts_of_events(system, each("x[{k}, j]"), at(2)),
    )  # fmt: skip
