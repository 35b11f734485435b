"""One case on a vo2: device, effects at their sizes, staircases that fit them, noise, files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import noise as sensor_noise
from ..sizing import NoSuchSizeError
from ..truth import Effect, Noise, Quantity
from .device import draw_device, parameters_of
from .effects import CATALOGUE, NEVER_TOGETHER, SLOW_STAIRCASE, Recipe
from .files import UNITS, RecordFile, draw_layout, write_dataset
from .inputs import draw_inputs, draw_rate, draw_staircases
from .options import Vo2Options
from .outside import OUTSIDE_CATALOGUE
from .physics import FloatArray
from .plant import Input, Output, Plant, simulate
from .refit import OUTPUTS, refitted_misses
from .sizing import amplitude_for, distinct, pooled, share_of
from .truth import Vo2Record, Vo2Truth

ATTEMPTS = 30


class RedrawError(Exception):
    """This draw makes no case; the next one of the same seed is tried."""


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """One case before any file is written; `inputs`, `clean`, `measured` by record, staircases and repeats included."""

    nominal: Plant
    plant: Plant
    """With all effects."""
    identified: Plant
    """Whose twin a faultless quasi-static identification finds."""
    rate_Hz: float
    inputs: list[Input]
    fits: list[Input]
    recipes: list[Recipe]
    amplitudes: list[float]
    shares: list[float]
    noises: dict[str, Noise]
    colours: dict[str, FloatArray]
    clean: list[Output]
    measured: list[dict[str, FloatArray]]
    without: int | None
    """Record whose file lacks the deflection."""


def generate_vo2(seed: int, folder: Path, options: Vo2Options) -> Vo2Truth:
    """Write the case of this seed; raises RuntimeError where no draw makes the wanted effects."""
    drawn, rng = draw_vo2(seed, options)
    return _written(rng, seed, folder, options, drawn)


def draw_vo2(seed: int, options: Vo2Options) -> tuple[Drawn, np.random.Generator]:
    """The case of this seed, and the random numbers that its files go on with; raises RuntimeError as above."""
    ids = draw_ids(np.random.default_rng([seed, 0, 2]), options)
    for attempt in range(1, ATTEMPTS + 1):
        rng = np.random.default_rng([seed, attempt, 2])
        try:
            return _drawn(rng, options, ids), rng
        except (RedrawError, NoSuchSizeError):
            continue
    raise RuntimeError(f"seed {seed}: no case with {ids} in {ATTEMPTS} draws; widen share={options.share}")


def draw_ids(rng: np.random.Generator, options: Vo2Options) -> tuple[str, ...]:
    """Ids of section 5, or names of outside effects. Drawn once: a redraw must not favour the easy ones."""
    if options.effects is not None:
        for name in options.effects:
            if name not in CATALOGUE and name not in OUTSIDE_CATALOGUE:
                known = ", ".join((*CATALOGUE, *OUTSIDE_CATALOGUE))
                raise ValueError(f"no effect {name!r}; there are {known}")
        return options.effects
    kinds = list(options.proportions)
    weights = np.array([options.proportions[kind] for kind in kinds])
    kind = options.kind or str(rng.choice(kinds, p=weights / weights.sum()))
    if kind == "null":
        return ()
    if kind == "outside":
        return (str(rng.choice(list(OUTSIDE_CATALOGUE))),)
    first = str(rng.choice(list(CATALOGUE)))
    if kind == "single":
        return (first,)
    while True:
        second = str(rng.choice(list(CATALOGUE)))
        if second.split(".")[0] != first.split(".")[0] and {first, second} not in NEVER_TOGETHER:
            return (first, second)


def _drawn(rng: np.random.Generator, options: Vo2Options, ids: tuple[str, ...]) -> Drawn:
    nominal, lowest = draw_device(rng)
    rate = draw_rate(rng, options)
    driven = draw_inputs(rng, options, nominal, lowest, rate)
    longest = max(r.current.size / r.rate_Hz for r in driven)
    recipes = [(CATALOGUE | OUTSIDE_CATALOGUE)[name](rng, nominal, longest) for name in ids]
    fits = distinct(driven)
    plant, identified, amplitudes, shares = _sized(rng, nominal, recipes, fits, options)
    slowest = max((r.slowest(a) for r, a in zip(recipes, amplitudes, strict=True)), default=0.0)
    inputs = draw_staircases(rng, options, nominal, lowest, min(slowest, SLOW_STAIRCASE)) + driven
    clean = [simulate(plant, record) for record in inputs]
    if not all(np.isfinite(o.resistance).all() and np.isfinite(o.deflection).all() for o in clean):
        raise RedrawError

    chosen = _of_fits(clean, inputs, fits)
    noises = _draw_noises(rng, options, {name: float(pooled(chosen, name).std()) for name in OUTPUTS})
    colours = {name: sensor_noise.noise_colour(rng, noise.kind) for name, noise in noises.items()}
    measured = [measure(rng, noises, colours, output) for output in clean]
    if any((reading["resistance"] <= 0.0).any() for reading in measured):
        raise RedrawError  # no instrument reads that, and `rtctl identify` refuses it
    return Drawn(
        nominal=nominal, plant=plant, identified=identified, rate_Hz=rate, inputs=inputs, fits=fits, recipes=recipes,
        amplitudes=amplitudes, shares=shares, noises=noises, colours=colours, clean=clean,
        measured=measured,
        without=_without_deflection(rng, options, inputs),
    )  # fmt: skip


def _of_fits(clean: list[Output], inputs: list[Input], fits: list[Input]) -> list[Output]:
    return [o for o, r in zip(clean, inputs, strict=True) if any(r is fit for fit in fits)]


def _written(
    rng: np.random.Generator, seed: int, folder: Path, options: Vo2Options, drawn: Drawn
) -> Vo2Truth:
    names = _write(rng, folder, f"case {seed}", options, drawn)
    fits, noises = drawn.fits, drawn.noises
    chosen = _of_fits(drawn.clean, drawn.inputs, fits)
    hidden = bool(drawn.recipes)
    misses = refitted_misses(drawn.identified, fits, chosen) if hidden else dict.fromkeys(OUTPUTS, 0.0)
    over_noise = [misses[name] / noises[name].rms for name in OUTPUTS]
    return Vo2Truth(
        seed=seed,
        plant="vo2",
        effects=tuple(
            Effect(
                id=recipe.id,
                variant=recipe.variant,
                parameters={k: Quantity(value=v, unit=unit) for k, (v, unit) in recipe.sizes(a).items()},
                share=share,
            )
            for recipe, a, share in zip(drawn.recipes, drawn.amplitudes, drawn.shares, strict=True)
        ),
        parameters=parameters_of(drawn.nominal.physics),
        sample_rate_Hz=drawn.rate_Hz,
        hold="zero",
        noises=noises,
        records=tuple(
            Vo2Record(
                name=name,
                use=record.use,
                excitation=record.excitation,
                sample_rate_Hz=record.rate_Hz,
                drive=record.current,
                clean={name: getattr(output, name) for name in OUTPUTS},
                measured={n: y for n, y in reading.items() if n != "deflection" or i != drawn.without},
            )
            for i, (name, record, output, reading) in enumerate(
                zip(names, drawn.inputs, drawn.clean, drawn.measured, strict=True)
            )
        ),
        share=share_of(drawn.plant, drawn.identified, fits) if hidden else 0.0,
        refitted_share=max(misses[name] / float(pooled(chosen, name).std()) for name in OUTPUTS),
        refitted_miss_over_noise=float(np.sqrt(np.mean(np.square(over_noise)))),
    )


def _sized(
    rng: np.random.Generator, nominal: Plant, recipes: list[Recipe], fits: list[Input], options: Vo2Options
) -> tuple[Plant, Plant, list[float], list[float]]:
    """The plant with all effects, the one whose twin an identification finds, amplitudes and shares (each alone)."""
    low, high = options.share
    plant, identified, amplitudes, shares = nominal, nominal, [], []
    for recipe in recipes:
        # inside by more than the search's tolerance, so that what is reached is inside too
        target = float(np.exp(rng.uniform(np.log(1.05 * low), np.log(0.95 * high))))
        amplitude, reached = amplitude_for(target, recipe, nominal, fits)
        if not low <= reached <= high:
            raise RedrawError
        plant = recipe.apply(plant, amplitude)
        identified = recipe.apply(identified, amplitude) if recipe.absorbed else identified
        amplitudes.append(amplitude)
        shares.append(reached)
    return plant, identified, amplitudes, shares


def _draw_noises(rng: np.random.Generator, options: Vo2Options, signal: dict[str, float]) -> dict[str, Noise]:
    noises = {}
    for name in OUTPUTS:
        snr_dB = options.snr_dB or float(rng.uniform(40.0, 60.0))
        kind = options.noise or str(rng.choice(sensor_noise.KINDS, p=[0.4, 0.15, 0.15, 0.15, 0.15]))
        rms = signal[name] * 10 ** (-snr_dB / 20)
        noises[name] = Noise(kind=kind, rms=rms, snr_db=snr_dB, unit=UNITS[name])
    return noises


def measure(
    rng: np.random.Generator, noises: dict[str, Noise], colours: dict[str, FloatArray], output: Output,
    like: int | None = None,
) -> dict[str, FloatArray]:  # fmt: skip
    """Readings of one record with noise; `like` as `add_noise` has it."""
    return {
        name: sensor_noise.add_noise(
            rng, getattr(output, name), noise.kind, noise.rms, colours[name], like=like
        )
        for name, noise in noises.items()
    }


def _without_deflection(rng: np.random.Generator, options: Vo2Options, inputs: list[Input]) -> int | None:
    """A record whose file lacks the deflection: not a staircase, not the first fit record."""
    drawn = bool(rng.random() < 0.15)
    eligible = [i for i, r in enumerate(inputs) if r.use != "identify" and r.position > 0]
    wanted = drawn if options.missing_deflection is None else options.missing_deflection
    return int(rng.choice(eligible)) if wanted else None


def _write(rng: np.random.Generator, folder: Path, name: str, options: Vo2Options, drawn: Drawn) -> list[str]:
    layout = draw_layout(rng, options.file_format)
    ignored = int(rng.integers(5, 30)) if rng.random() < 0.15 else 0
    numbers = [record.number for record in drawn.inputs]
    files = [
        RecordFile(
            columns={"current": record.current}
            | {n: y for n, y in reading.items() if n != "deflection" or i != drawn.without},
            rate_Hz=record.rate_Hz,
            use=record.use,
            repeat="A" if numbers.count(record.number) > 1 else None,
            ignore_first=ignored if record.use != "identify" else 0,
            excitation=record.excitation,
        )
        for i, (record, reading) in enumerate(zip(drawn.inputs, drawn.measured, strict=True))
    ]
    return write_dataset(folder, name, layout, files)
