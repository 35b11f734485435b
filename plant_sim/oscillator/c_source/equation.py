"""The equation of motion in C: its rows from the parameters, its acceleration from the laws, its friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from plant_sim.oscillator.c_source.traced import Traced, c_text
from plant_sim.oscillator.c_source.translation import CLaws
from plant_sim.oscillator.equation.terms import NOMINAL, RUBBING, TERMS, law_for
from plant_sim.oscillator.integration import friction
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values
from plant_sim.oscillator.nominal import ROWS


@dataclass(frozen=True, slots=True, kw_only=True)
class CEquation:
    """The parts of the equation that stand in the source."""

    coefficients: str
    """`fill_rows`, `start_own`."""
    forces: str
    """Laws, `acceleration`, `impulse`, and of dry friction `resistance`, `within_step`, `settle`."""
    rows: int
    own_states: int
    """States of the mechanisms."""
    rubs: bool
    """Whether there is dry friction."""


def c_equation(nominal: Values, mechanisms: Sequence[tuple[OscillatorMechanism, Values]]) -> CEquation:
    """Return the equation.

    Args:
        nominal: Traced values of the nominal parameters by name.
        mechanisms: Those that act, in the order of their ids, with their traced values by name.

    Raises:
        TypeError: A law has no form in C; it is named.
    """
    laws = CLaws()
    table: dict[str, float] = dict.fromkeys(TERMS, 0.0)
    for name, row in ROWS.items():
        table[row] = nominal[name]
    terms = set(NOMINAL)
    memories: list[tuple[Memory, Values]] = []
    for one, values in mechanisms:
        for row, made in one.terms.items():
            table[row] = table[row] + (values[made] if isinstance(made, str) else made(values))
            terms.add(row)
        if one.memory is not None and one.memory.acts(values):
            memories.append((one.memory, values))
    memoryless = laws.add(law_for(terms - RUBBING, memory=bool(memories)))
    lines, calls, dampers, starts, steps = [c_text(table[row]) for row in TERMS], [], [], [], []
    states = 0
    for memory, values in memories:
        first = len(lines)
        calls.append((laws.add(memory.law), first, states, memory.states))
        if memory.damping is not None:
            dampers.append((laws.add(memory.damping), first))
        if memory.step is not None:
            steps.append(first + memory.step)
        lines += [c_text(value) for value in memory.constants(values)]
        begun = (
            (0.0,) * memory.states
            if memory.start is None
            else memory.start(Traced(0.0, "z"), Traced(0.0, "v"))
        )
        starts += [c_text(value) for value in begun]
        states += memory.states
    fades = float(table["friction_excess"]) != 0.0
    rubs = fades or float(table["friction"]) != 0.0
    rubbing = _friction(laws, fades=fades) if rubs else ""
    return CEquation(
        coefficients="\n".join((_rows(lines, steps), _start(starts))),
        forces="\n".join((laws.text(), _acceleration(memoryless, calls), _impulse(dampers), rubbing)),
        rows=len(lines), own_states=states, rubs=rubs,
    )  # fmt: skip


def _rows(lines: Sequence[str], steps: Sequence[int]) -> str:
    """Return `fill_rows`: coefficients of the terms, then the constants of each mechanism."""
    meaning = [*TERMS, *("" for _ in range(len(lines) - len(TERMS)))]
    body = "".join(
        f"    p[{k}] = {text};{f' /* {word} */' if word else ''}\n"
        for k, (text, word) in enumerate(zip(lines, meaning, strict=True))
    )
    body += "".join(f"    p[{row}] = h; /* the integrator's step */\n" for row in steps)
    return f"static void fill_rows(const double *value, double h, double *p)\n{{\n    (void)value; (void)h;\n{body}}}\n"


def _acceleration(memoryless: str, calls: Sequence[tuple[str, int, int, int]]) -> str:
    """Return `acceleration`, which also fills the rates of the mechanisms' states."""
    body = f"    double a = {memoryless}(z, v, u, t, p);\n"
    for name, row, first, count in calls:
        body += f"    {{\n        double made[{count + 1}];\n"
        body += f"        {name}(z, v, u, t, w + {first}, p, {row}, made);\n        a += made[0];\n"
        body += "".join(f"        rates[{first + k}] = made[{k + 1}];\n" for k in range(count)) + "    }\n"
    return (
        "static double acceleration(double z, double v, double u, double t, const double *w, const double *p, "
        f"double *rates)\n{{\n    (void)w; (void)rates;\n{body}    return a;\n}}\n"
    )


def _impulse(dampers: Sequence[tuple[str, int]]) -> str:
    """Return `impulse`: what dampers that act at some places alone take from the velocity."""
    body = "".join(
        f"    {{\n        double made[2];\n        {name}(z, p, {row}, made);\n        taken += made[0];\n    }}\n"
        for name, row in dampers
    )
    return (
        "static double impulse(double z, const double *p)\n{\n    double taken = 0.0;\n    (void)z; (void)p;\n"
        f"{body}    return taken;\n}}\n"
    )


def _start(starts: Sequence[str]) -> str:
    """Return `start_own`: the mechanisms' states where a motion starts."""
    body = "".join(f"    w[{k}] = {text};\n" for k, text in enumerate(starts))
    return f"static void start_own(double z, double v, double *w)\n{{\n    (void)z; (void)v; (void)w;\n{body}}}\n"


def _friction(laws: CLaws, *, fades: bool) -> str:
    """Return the names of the laws of dry friction; the laws are translated."""
    resistance = laws.add(friction.fading_resistance if fades else friction.resistance)
    within = laws.add(friction.faded if fades else friction.constant)
    from_rest, through_turn = laws.add(friction.from_rest), laws.add(friction.through_turn)
    level = "p[FRICTION] + p[FRICTION_EXCESS]" if fades else "p[FRICTION]"
    held = f"copysign({laws.add(friction.sliding)}(*v / sqrt(3.0), p), held)" if fades else "held"
    return f"""\
enum {{ FRICTION = {TERMS.index("friction")}, FRICTION_EXCESS = {TERMS.index("friction_excess")} }};
#define resistance {resistance}
#define within_step {within}

/* Puts right a step that turned, or began at rest; a motion at rest stays there until the other forces exceed it. */
static void settle(double *z, double *v, double z1, double v1, double a1, double a4, double held, double h,
                   const double *p)
{{
    double out[2] = {{*z, *v}};
    if (v1 == 0.0) {{
        if (fabs(held) < {level}) {from_rest}(z1, a4, held, h, {level}, out);
    }} else if (*v * v1 < 0.0) {{
        {through_turn}(z1, v1, a1, *z, *v, {held}, h, out);
    }}
    *z = out[0];
    *v = out[1];
}}
"""
