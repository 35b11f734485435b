"""One case on an oscillator: device, records, effects at their sizes, noise, files."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import noise as sensor_noise
from .added import ADDED
from .device import Device, draw_device, draw_drive_scale
from .effects import CATALOGUE, NEVER_TOGETHER, Recipe, Surroundings
from .equation import P
from .files import RecordFile, draw_layout, write_dataset, write_model
from .inputs import GAP, draw_inputs, gain_of, made_predictable, predictable
from .options import Options
from .outside import OUTSIDE_CATALOGUE
from .plan import FloatArray, Input, LeftDeviceError, Plan, simulate
from .refit import refitted_miss
from .sizing import NoSuchSizeError, amplitude_for, distinct, responses, share_moved
from .truth import Effect, Noise, Quantity, RecordTruth, Truth

ATTEMPTS = 40
SLOW = ("stiffness.drift", "stiffness_jumps")
PAIR_SHARE_SLACK = 2.0
"""The first effect of a pair is sized alone; with both on, its share may leave the range by this factor."""


class RedrawError(Exception):
    """This draw makes no case; the next one of the same seed is tried."""


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """One case before any file is written; `inputs`, `clean`, `starts`, `measured` by record, repeats included."""

    device: Device
    nominal: Plan
    plan: Plan
    """With all effects."""
    drive_scale: float
    inputs: list[Input]
    slices: bool
    recipes: list[Recipe]
    amplitudes: list[float]
    shares: list[float]
    share: float
    miss: float
    """rms that the re-fitted nominal model misses, in L."""
    signal: float
    noise: str
    noise_rms: float
    """In L."""
    snr_dB: float
    colour: FloatArray
    clean: list[FloatArray]
    starts: list[float]
    measured: list[FloatArray]
    at_rest: FloatArray


def generate_oscillator(seed: int, folder: Path, options: Options) -> Truth:
    """Write the case of this seed; raises RuntimeError where no draw makes the wanted effects."""
    drawn, rng = draw_oscillator(seed, options)
    return _written(rng, seed, folder, options, drawn)


def draw_oscillator(seed: int, options: Options) -> tuple[Drawn, np.random.Generator]:
    """The case of this seed, and the random numbers that its files go on with; raises RuntimeError as above."""
    ids = _draw_ids(np.random.default_rng([seed, 0]), options)
    for attempt in range(1, ATTEMPTS + 1):
        rng = np.random.default_rng([seed, attempt])
        try:
            return _drawn(rng, options, ids), rng
        except (RedrawError, NoSuchSizeError, LeftDeviceError):
            continue
    raise RuntimeError(f"seed {seed}: no case with {ids} in {ATTEMPTS} draws; widen share={options.share}")


def _draw_ids(rng: np.random.Generator, options: Options) -> tuple[str, ...]:
    """Ids of section 5, or names of outside effects. Drawn once: a redraw must not favour the easy ones."""
    if options.effects is not None:
        return options.effects
    kinds = list(options.proportions)
    weights = np.array([options.proportions[kind] for kind in kinds])
    kind = options.kind or str(rng.choice(kinds, p=weights / weights.sum()))
    names = list(CATALOGUE)
    if kind == "null":
        return ()
    if kind == "outside":
        return (str(rng.choice(list(OUTSIDE_CATALOGUE))),)
    first = str(rng.choice(names))
    if kind == "single":
        return (first,)
    while True:
        second = str(rng.choice(names))
        if _place(second) != _place(first) and {first, second} not in NEVER_TOGETHER:
            return (first, second)


def _place(name: str) -> str:
    dissipates = name.startswith("damping.") or name == "friction.coulomb"
    kind = name.split(".")[0]
    return "dissipation" if dissipates else {"input": "drive", "hysteresis": "stiffness"}.get(kind, kind)


def _drawn(rng: np.random.Generator, options: Options, ids: tuple[str, ...]) -> Drawn:
    device = draw_device(rng, options, ids)
    nominal = device.plan()
    inputs, slices = draw_inputs(rng, options, nominal)
    inputs = made_predictable(nominal, inputs)
    gain = gain_of(inputs)
    inputs = [replace(record, drive=record.drive / gain) for record in inputs]
    nominal = nominal.having(G=gain)
    drive_scale = draw_drive_scale(rng, device, gain)
    recipes = _recipes(rng, device, nominal, inputs, options, ids)
    plan, amplitudes, shares, share = _sized(rng, nominal, recipes, distinct(inputs), options)
    clean, starts = _outputs(plan, inputs)
    if recipes and not all(predictable(plan, record) for record in inputs):
        raise RedrawError

    fit_outputs = {r.number: y for r, y in zip(inputs, clean, strict=True)}
    fits = distinct(inputs)
    miss = 0.0
    if recipes:
        miss = refitted_miss(
            nominal, fits, [fit_outputs[r.number] for r in fits], any(i in SLOW for i in ids)
        )
    pooled = np.concatenate([fit_outputs[r.number] for r in fits])
    signal = float(np.sqrt(np.mean((pooled - nominal.rest) ** 2)))
    snr_dB = options.snr_dB or float(rng.uniform(40.0, 60.0))
    rms = signal * 10 ** (-snr_dB / 20)
    kind = options.noise or str(rng.choice(sensor_noise.KINDS, p=[0.4, 0.15, 0.15, 0.15, 0.15]))
    colour = sensor_noise.noise_colour(rng, kind)
    measured, at_rest = _measure(rng, kind, rms, colour, clean, plan, inputs)
    return Drawn(
        device=device, nominal=nominal, plan=plan, drive_scale=drive_scale, inputs=inputs, slices=slices,
        recipes=recipes, amplitudes=amplitudes, shares=shares, share=share, miss=miss, signal=signal, noise=kind,
        noise_rms=rms, snr_dB=snr_dB, colour=colour, clean=clean, starts=starts, measured=measured, at_rest=at_rest,
    )  # fmt: skip


def _written(rng: np.random.Generator, seed: int, folder: Path, options: Options, drawn: Drawn) -> Truth:
    device = drawn.device
    names = _write(rng, folder, f"case {seed}", options, drawn)
    true = _parameters(device, drawn.nominal, drawn.drive_scale)
    write_model(folder, _mistaken(rng, true, options))
    effects = tuple(
        Effect(
            id=recipe.id,
            variant=recipe.variant,
            parameters={
                key: device.quantity(*value, drawn.drive_scale)
                for key, value in recipe.sizes(amplitude).items()
            },
            share=own,
        )
        for recipe, amplitude, own in zip(drawn.recipes, drawn.amplitudes, drawn.shares, strict=True)
    )
    return Truth(
        seed=seed,
        plant="oscillator",
        effects=effects,
        parameters=true,
        f0_Hz=device.f0_Hz,
        quality=device.quality,
        sample_rate_Hz=device.f0_Hz * device.samples_a_period,
        samples_a_period=device.samples_a_period,
        hold=device.manifest_hold,
        noise=Noise(
            kind=drawn.noise,
            rms=drawn.noise_rms * device.length,
            snr_db=drawn.snr_dB,
            unit=device.displacement_unit,
        ),
        records=tuple(
            RecordTruth(
                name=name,
                use=record.use,
                excitation=record.excitation,
                drive=_cut(record.drive, options) * drawn.drive_scale,
                clean=_cut(y, options) * device.length,
                measured=_cut(x, options) * device.length,
            )
            for name, record, y, x in zip(names, drawn.inputs, drawn.clean, drawn.measured, strict=True)
        ),
        share=drawn.share,
        refitted_share=drawn.miss / drawn.signal,
        refitted_miss_over_noise=drawn.miss / drawn.noise_rms,
        equivalent=_equivalent(device, tuple(effect.id for effect in effects)),
    )


def _recipes(
    rng: np.random.Generator,
    device: Device,
    plan: Plan,
    inputs: list[Input],
    options: Options,
    ids: tuple[str, ...],
) -> list[Recipe]:
    recipes = []
    for i, name in enumerate(ids):
        around = Surroundings(
            bistable=device.shape == "bistable",
            well=device.well,
            sample_time=plan.sample_time,
            longest=plan.sample_time * max(record.drive.size for record in inputs),
            omega0=device.omega0,
            manifest_hold=device.manifest_hold,
            variant=options.variant if i == 0 else None,
            radian=device.radian,
        )
        known = CATALOGUE | OUTSIDE_CATALOGUE | ADDED
        if name not in known:
            raise ValueError(f"no effect {name!r}; there are {', '.join(known)}")
        recipes.append(known[name](rng, around))
    return recipes


def _sized(
    rng: np.random.Generator, nominal: Plan, recipes: list[Recipe], fits: list[Input], options: Options
) -> tuple[Plan, list[float], list[float], float]:
    """The plan with all effects on; amplitude and share of each (the others being on), share of all."""
    low, high = options.share
    plan, amplitudes, shares = nominal, [], []
    for recipe in recipes:
        # inside by more than the search's tolerance, so that what is reached is inside too
        target = float(np.exp(rng.uniform(np.log(1.05 * low), np.log(0.95 * high))))
        amplitude, reached = amplitude_for(target, recipe, plan, fits)
        if not low <= reached <= high:
            raise RedrawError
        plan = recipe.apply(plan, amplitude)
        amplitudes.append(amplitude)
        shares.append(reached)
    if len(recipes) < 2:
        return plan, amplitudes, shares, shares[0] if shares else 0.0
    both = responses(plan, fits)
    for i in range(len(recipes) - 1):
        others = nominal
        for j, recipe in enumerate(recipes):
            others = others if j == i else recipe.apply(others, amplitudes[j])
        shares[i] = share_moved(responses(others, fits), both, nominal.rest)
        if not low / PAIR_SHARE_SLACK <= shares[i] <= high * PAIR_SHARE_SLACK:
            raise RedrawError
    return plan, amplitudes, shares, share_moved(responses(nominal, fits), both, nominal.rest)


def _outputs(plan: Plan, inputs: list[Input]) -> tuple[list[FloatArray], list[float]]:
    """Noise-free reading and initial displacement of each record, repeats included (hum differs between them)."""
    outputs = [simulate(plan, record) for record in inputs]
    return [y for y, _ in outputs], [start for _, start in outputs]


def _measure(
    rng: np.random.Generator,
    kind: str,
    rms: float,
    colour: FloatArray,
    clean: list[FloatArray],
    plan: Plan,
    inputs: list[Input],
) -> tuple[list[FloatArray], FloatArray]:
    """Readings with noise, and the reading at rest between slices."""
    measured = [sensor_noise.add_noise(rng, y, kind, rms, colour) for y in clean]
    resting = [
        replace(r, drive=np.zeros(GAP), displaced=0.0, file_start=r.file_start + r.drive.size) for r in inputs
    ]
    at_rest = np.concatenate([simulate(plan, record)[0] for record in resting])
    return measured, sensor_noise.add_noise(rng, at_rest, kind, rms, colour, like=clean[0].size)


def _write(rng: np.random.Generator, folder: Path, name: str, options: Options, drawn: Drawn) -> list[str]:
    device, inputs = drawn.device, drawn.inputs
    layout = draw_layout(rng, drawn.slices, GAP, options.file_format)
    layout = replace(layout, at_rest=drawn.at_rest * device.length)
    ignored = int(rng.integers(20, 200)) if rng.random() < 0.15 else 0
    numbers = [record.number for record in inputs]
    files = [
        RecordFile(
            drive=_cut(record.drive, options) * drawn.drive_scale,
            displacement=_cut(y, options) * device.length,
            use=record.use,
            repeat="A" if numbers.count(record.number) > 1 else None,
            initial=start * device.length if record.displaced and not options.cut else None,
            ignore_first=ignored,
            excitation=record.excitation,
        )
        for record, y, start in zip(inputs, drawn.measured, drawn.starts, strict=True)
    ]
    folder.mkdir(parents=True, exist_ok=True)
    rate = device.f0_Hz * device.samples_a_period
    units = {"drive": device.drive_unit, "displacement": device.displacement_unit}
    return write_dataset(folder, name, layout, files, rate, units, device.manifest_hold)


def _cut(series: FloatArray, options: Options) -> FloatArray:
    return series[round(options.cut * series.size) :]


def _parameters(device: Device, nominal: Plan, drive_scale: float) -> dict[str, Quantity]:
    p = nominal.parameters
    parameters = {
        "damping": device.quantity(p[P.C], 0, -1, 0, drive_scale),
        "stiffness": device.quantity(p[P.K], 0, -2, 0, drive_scale),
        "drive_gain": device.quantity(p[P.G], 1, -2, -1, drive_scale),
    }
    if p[P.K3] != 0.0:
        parameters["stiffness_cubic"] = device.quantity(p[P.K3], -2, -2, 0, drive_scale)
    return parameters


def _mistaken(rng: np.random.Generator, true: dict[str, Quantity], options: Options) -> dict[str, Quantity]:
    """What the user believes: each value off by up to 1, 3 or 10 %."""
    most = (
        options.parameter_error
        if options.parameter_error is not None
        else float(rng.choice([0.01, 0.03, 0.1]))
    )
    return {
        name: Quantity(value=q.value * (1.0 + most * rng.uniform(-1.0, 1.0)), unit=q.unit)
        for name, q in true.items()
    }


def _equivalent(device: Device, ids: tuple[str, ...]) -> tuple[str, ...]:
    """Ids that would describe the same outputs by construction, whatever the records are."""
    if device.shape != "none" or len(ids) != 1:
        return ()
    linear = ({"drive.offset", "sensor.offset"}, {"drive.lag", "sensor.lag"})
    return tuple(sorted(other for pair in linear if ids[0] in pair for other in pair - {ids[0]}))
