"""What inputs go through before the equations, and outputs behind them, as C: one statement for each mechanism."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import plant_sim.oscillator.c_source.signals as shared
from plant_sim.equations.c_source.laws import number
from plant_sim.equations.exported.extended import Outside
from plant_sim.equations.system import System
from plant_sim.oscillator.c_source.signals import line_size
from rtctl.border.exported.c_plant import CVariable, steps_kept

FOLDER, SHARED = Path(__file__).parent, Path(shared.__file__).parent
REASONS = {
    "skew": "the reading of a row at another instant is a matter of the recording, not of the plant",
    "hold": "the simulator says how an input goes on between communication points",
}
"""Why mechanisms of signals have no form in C, by the last word of their ids."""
INPUT_LAWS = {
    "delay": "if (h > 0.0 && !delayed(&s->{own}, t, h, {delay}, {within}, c)) return FORGOTTEN(\"{id}\");",
    "gain_drift": "for (int n = 0; n < 3; n++) c[n] *= 1.0 + {rate} * drifted(t + 0.5 * n * h, {settling_time});",
    "offset": "for (int n = 0; n < 3; n++) c[n] += {offset};",
    "dead_band": "for (int n = 0; n < 3; n++) c[n] -= cut(c[n], -{width}, {width});",
    "saturation": "for (int n = 0; n < 3; n++) c[n] = bent(c[n], {curvature}, {clipped}, {limit});",
    "lag": "if (s->begun == 0.0) s->{own} = {settled} * c[0];\n"
    "        if (h > 0.0) through_lag(c, h / {time_constant}, &s->{own});\n"
    "        else c[0] = c[1] = c[2] = s->{own};",
    "backlash": "if (s->begun == 0.0) s->{own} = 0.0;\n"
    "        for (int n = 0; n < 3; n++) c[n] = s->{own} = cut(s->{own}, c[n] - {width}, c[n] + {width});",
}  # fmt: skip
NOW_LAWS = {
    "gain_drift": "c *= 1.0 + {rate} * drifted(t, {settling_time});",
    "offset": "c += {offset};",
    "dead_band": "c -= cut(c, -{width}, {width});",
    "saturation": "c = bent(c, {curvature}, {clipped}, {limit});",
    "backlash": "c = cut(s->{own}, c - {width}, c + {width});",
}
"""The same of an input as it is set now; what is delayed or lags is as it was at the end of the last step."""
REMEMBERING = {
    "highpass": "past_filter(&s->{own}, {rate}, interval, &c);",
    "lag": "through_filter(&s->{own}, 1.0 / {time_constant}, interval, &c);",
}
"""Instruments that remember; they come before the others."""
INSTRUMENTS = {
    "saturation": "y = bent(y, {curvature}, {clipped}, {limit});",
    "offset": "y += {offset};",
    "hum": "y += {cosine} * cos(TURN * {frequency} * t) + {sine} * sin(TURN * {frequency} * t);",
    "drift": "y += {rate} * drifted(t, {settling_time});",
}


@dataclass(frozen=True, slots=True)
class Signals:
    """The mechanisms of a model's signals in C."""

    name: str
    """Source, for messages."""
    system: System
    outside: tuple[Outside, ...]
    step_s: float
    first: int
    """Place of the first parameter of a mechanism in the unit."""

    @property
    def parameters(self) -> tuple[CVariable, ...]:
        """Parameters of the mechanisms."""
        return tuple(variable for one in self.outside for variable in one.variables)

    @property
    def kept(self) -> int:
        """Communication steps that are remembered of a delayed input."""
        delays = {one.id: one.values["delay"] for one in self.outside if one.is_input and one.law == "delay"}
        longest = max(delays, key=lambda name: delays[name], default="")
        return steps_kept(delays.get(longest, 0.0), self.step_s, f"{self.name}: {longest}")

    @property
    def memory(self) -> int:
        """Numbers that all of it remembers."""
        if not self.outside:
            return 0
        sizes = {"delay": line_size(self.kept), "lag": 1, "backlash": 1}
        inputs = sum(sizes.get(one.law, 0) for one in self.outside if one.is_input)
        return 1 + max(len(self.system.inputs), 1) + len(self.system.outputs) + inputs + self.filters

    @property
    def filters(self) -> int:
        """Instruments that remember."""
        return sum(not one.is_input and one.law in REMEMBERING for one in self.outside)

    def source(self) -> Iterator[str]:
        """Yield the source; nothing where no mechanism acts."""
        if not self.outside:
            return
        yield "#define SIGNALS"
        yield f"#define KEPT {self.kept}"
        yield (SHARED / "paths.c").read_text(encoding="utf-8")
        if any(one.law == "delay" for one in self.outside):
            yield (SHARED / "delay.c").read_text(encoding="utf-8")
        yield (FOLDER / "instruments.c").read_text(encoding="utf-8")
        if self.filters:
            yield "#define FILTERS"
        yield "\n".join(self._record())
        yield self._function(
            "static const char *input_paths(signals *s, const double *value, double t, double h, "
            "double (*u)[PLANT_AT_LEAST_ONE(PLANT_INPUTS)])",
            self._inputs(), "    s->begun = h > 0.0 ? 1.0 : s->begun;\n    return 0;",
        )  # fmt: skip
        yield self._function(
            "static void instruments_between(signals *s, const double *value, double interval, "
            "double (*all)[PLANT_OUTPUTS])",
            self._filtered(), "",
        )  # fmt: skip
        yield self._function("static void remember_inputs(signals *s, const plant *m)", self._pushed(), "")
        yield self._function(
            "static void inputs_behind(\n    const signals *s, const double *value, const double *level, "
            "double t, double *u)",
            self._replaced_inputs(),
            "",
        )
        yield self._function(
            "static void outputs_behind(const signals *s, double *y)", self._replaced_outputs(), ""
        )
        yield self._function(
            "static void instruments(const double *value, double t, double *all)",
            self._outputs(),
            "",
        )

    def _record(self) -> Iterator[str]:
        yield "typedef struct {"
        yield "    double begun;"
        yield "    double input[PLANT_AT_LEAST_ONE(PLANT_INPUTS)]; /* as it reaches the equations */"
        yield "    double behind[PLANT_OUTPUTS]; /* behind the instruments that remember */"
        for one in self.outside:
            kinds = {"delay": "line", "lag": "double", "backlash": "double"}
            kind = kinds.get(one.law) if one.is_input else "double" if one.law in REMEMBERING else None
            if kind is not None:
                yield f"    {kind} {one.c_name}; /* {one.id} */"
        yield "} signals;\n"

    def _inputs(self) -> Iterator[str]:
        for k, source in enumerate(self.system.inputs):
            own = [one for one in self.outside if one.is_input and one.signal == source.name]
            if own:
                yield f"    {{ /* {source.name} */"
                yield f"        double c[3] = {{u[0][{k}], u[1][{k}], u[2][{k}]}};"
                yield from self._statements(own, INPUT_LAWS)
                yield f"        for (int n = 0; n < 3; n++) u[n][{k}] = c[n];\n    }}"
        if self.system.inputs:
            yield "    memcpy(s->input, u[2], sizeof s->input);"

    def _filtered(self) -> Iterator[str]:
        """Yield what takes the course of each output over a step through its instruments that remember."""
        for k, name, own in self._of_outputs(REMEMBERING):
            reference = number(own[0].reference)
            yield f"    {{ /* {name} */"
            yield f"        course c = {{all[0][{k}] - {reference}, all[1][{k}],"
            yield f"            all[2][{k}] - {reference}, all[3][{k}]}};"
            yield from self._statements(own, REMEMBERING)
            yield f"        s->behind[{k}] = c.to + {reference};\n    }}"

    def _outputs(self) -> Iterator[str]:
        """Yield what the other instruments make of each output."""
        for k, name, own in self._of_outputs(INSTRUMENTS):
            yield f"    {{ /* {name} */"
            yield f"        double y = all[{k}] - {number(own[0].reference)};"
            yield from self._statements(own, INSTRUMENTS)
            yield f"        all[{k}] = y + {number(own[0].reference)};\n    }}"

    def _of_outputs(self, laws: Mapping[str, str]) -> Iterator[tuple[int, str, list[Outside]]]:
        """Yield place and name of each output with its mechanisms of these laws, if it has any."""
        for k, output in enumerate(self.system.outputs):
            own = [
                one for one in self.outside
                if not one.is_input and one.signal == output.name and one.law in laws
            ]  # fmt: skip
            if own:
                yield k, output.name, own

    def _pushed(self) -> Iterator[str]:
        """Yield what notes the communication step of delayed inputs."""
        places = {source.name: k for k, source in enumerate(self.system.inputs)}
        for one in self.outside:
            if one.is_input and one.law == "delay":
                k = places[one.signal]
                yield f"    push(&s->{one.c_name}, m->time, m->input[{k}], m->slope[{k}]);"

    def _replaced_inputs(self) -> Iterator[str]:
        """Yield what sets the inputs that mechanisms change to what reaches the equations now [SI]."""
        for k, source in enumerate(self.system.inputs):
            own = [one for one in self.outside if one.is_input and one.signal == source.name]
            if any(one.law in ("delay", "lag") for one in own):
                yield f"    u[{k}] = s->input[{k}] * input_factors[{k}];"
            elif own:
                yield f"    {{ /* {source.name} */\n        double c = level[{k}];"
                yield from self._statements(own, NOW_LAWS)
                yield f"        u[{k}] = c * input_factors[{k}];\n    }}"

    def _replaced_outputs(self) -> Iterator[str]:
        """Yield what sets the outputs that a remembering instrument reads."""
        changed = {one.signal for one in self.outside if not one.is_input and one.law in REMEMBERING}
        for k, output in enumerate(self.system.outputs):
            if output.name in changed:
                yield f"    y[{k}] = s->behind[{k}];"

    def _statements(self, own: Iterable[Outside], laws: Mapping[str, str]) -> Iterator[str]:
        names = [one.name for one in self.parameters]
        own = list(own)
        bends = any(one.mechanism.law.bends for one in own if one.mechanism.law)
        within = int(bends or bool(self.system.events))
        for one in sorted(own, key=lambda one: one.stage):
            values = {word: f"value[{self.first + names.index(f'{one.id}.{word}')}]" for word in one.values}
            yield "        " + laws[one.law].format(own=one.c_name, id=one.id, within=within, **values)

    def _function(self, head: str, body: Iterable[str], tail: str) -> str:
        words = ("s", "value", "level", "t", "h", "interval", "all", "m", "u", "y")
        unused = [word for word in words if f"{word}," in head or f"{word})" in head]
        lines = [*(f"    (void){word};" for word in unused), *body, *([tail] if tail else [])]
        return "\n".join([head, "{", *lines, "}", ""])
