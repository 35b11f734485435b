"""Periodic drives and readings: what the mechanisms before and behind the equation make of one period.

A course over a period is its harmonics, so that a lag, a delay or a second mode is one factor on each: what it does
in a record that has gone on for ever.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plant_sim.oscillator.mechanism import Driven, Moved, OscillatorMechanism, Values
from rtctl.border.arrays import ComplexArray, FloatArray

Active = Sequence[tuple[OscillatorMechanism, Values]]
"""Mechanisms that act, in the order of their stages, each with its values."""


class PeriodicDrive(NamedTuple):
    """One period of a drive at half steps."""

    course: FloatArray
    """Drive (2 steps,) at the start and the middle of each step, from the crest of its source on."""
    frequency_hz: float

    @property
    def nodes(self) -> FloatArray:
        """Return the drive (steps, 3) at start, middle and end of each step."""
        found = np.empty((len(self.course) // 2, 3))
        found[:, 0], found[:, 1] = self.course[::2], self.course[1::2]
        found[:-1, 2], found[-1, 2] = self.course[2::2], self.course[0]
        return found

    @property
    def driven(self) -> Driven:
        """Return the drive as the integrator takes it."""
        return Driven(self.nodes, self.step_s)

    @property
    def step_s(self) -> float:
        """Return the integrator's step [s]."""
        return 2.0 / (len(self.course) * self.frequency_hz)


def drive_of(amplitude: float, frequency_hz: float, steps: int, active: Active) -> PeriodicDrive:
    """Return what drives the equation if the source gives amplitude cos(2 pi f t)."""
    angle = np.pi * np.arange(2 * steps) / steps
    drive = PeriodicDrive(amplitude * np.cos(angle), frequency_hz)
    for mechanism, values in active:
        if not mechanism.acts_before_the_equation:
            continue
        if mechanism.transfer is not None:
            s = harmonics(len(drive.course), frequency_hz)
            drive = drive._replace(course=_filtered(drive.course, mechanism.transfer(s, values)))
        elif mechanism.drive is not None:
            twice = Driven(
                np.tile(drive.nodes, (2, 1)), drive.step_s
            )  # a play has its state after one period
            settled = mechanism.drive(twice, values).nodes[steps:]
            drive = drive._replace(course=np.ascontiguousarray(settled[:, :2]).reshape(-1))
    return drive


def readings_of(
    displacement: FloatArray, drive: PeriodicDrive, derivatives: int, lanes: Sequence[Active]
) -> ComplexArray:
    """Return the complex amplitudes (lanes,) that a lock-in reads: Re is in phase with the source, Im leads it.

    Args:
        displacement: Displacement (steps, lanes) over one period.
        drive: The drive of the equation.
        derivatives: Time derivatives of the displacement that the sensor reads.
        lanes: Mechanisms that act in each lane.
    """
    steps = len(displacement)
    s = harmonics(steps, drive.frequency_hz)
    if not any(one.sensor for one, _ in lanes[0]):
        turn = np.exp(-2j * np.pi * np.arange(steps) / steps)
        return np.asarray(2.0 / steps * s[1] ** derivatives * (turn @ displacement))
    spectra = np.fft.rfft(displacement, axis=0).T * s**derivatives
    read = (
        _behind(spectrum, drive, derivatives, active) for spectrum, active in zip(spectra, lanes, strict=True)
    )
    return np.array([2.0 * spectrum[1] / steps for spectrum in read])


def _behind(spectrum: ComplexArray, drive: PeriodicDrive, derivatives: int, active: Active) -> ComplexArray:
    """Return the spectrum (harmonics,) of what a sensor reads."""
    samples = len(drive.course) // 2
    s = harmonics(samples, drive.frequency_hz)
    for mechanism, values in active:
        if mechanism.beside is not None:
            spectrum = spectrum + mechanism.beside(s, derivatives, values) * np.fft.rfft(drive.course[::2])
        elif mechanism.sensor is not None and mechanism.transfer is not None:
            spectrum = spectrum * mechanism.transfer(s, values)
        elif mechanism.sensor is not None:
            course, slope = np.fft.irfft(spectrum, samples), np.fft.irfft(spectrum * s, samples)
            time_s = drive.step_s * np.arange(samples, dtype=np.float64)
            moved = Moved(course, slope, time_s, drive.step_s, drive.driven, 1, derivatives)
            spectrum = np.fft.rfft(mechanism.sensor(moved, values).displacement)
    return np.asarray(spectrum, np.complex128)


def harmonics(samples: int, frequency_hz: float) -> ComplexArray:
    """Return s = 2 pi i k f [1/s] of the harmonics k of a course of `samples` over one period."""
    return np.asarray(2j * np.pi * frequency_hz * np.arange(samples // 2 + 1), np.complex128)


def _filtered(course: FloatArray, factors: ComplexArray) -> FloatArray:
    """Return a course with a factor on each harmonic; what is left of the last one is real."""
    return np.asarray(np.fft.irfft(np.fft.rfft(course) * factors, len(course)))
