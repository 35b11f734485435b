"""Thresholds of the design of the next experiment: each with its unit, its reason and the measurement that chose it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentThresholds:
    """Numbers of the design of the next experiment."""

    # Candidate inputs
    drive_levels: tuple[float, ...] = (0.25, 0.5, 1.0)
    """Levels of the candidate inputs, as fractions of the largest drive in the data; only the last is also sampled more
    slowly."""
    max_samples: int = 4096
    """Largest number of sample periods, at the rate of the data, that a candidate input lasts."""
    length_ratio: int = 4
    """Length of a candidate input over the median length of the records: where these are so short that they leave
    several candidates open, a longer record tells more."""
    min_samples_per_period: float = 3.0
    """Smallest number of samples in a period of the motion of a record that is sampled more slowly."""
    square_wave_frequencies: tuple[float, ...] = (0.5, 0.7, 1.0, 1.4, 2.0, 4.0, 8.0, 16.0)
    """Frequencies of the square waves over the dominant frequency of the motion. A square wave has all of its power at
    a few lines; a delay and a lag differ far above the dominant frequency, and the parameters fitted beside them are
    learned near it."""
    min_half_wave_samples: int = 2
    """Shortest half of a square wave [samples]."""
    max_telegraph_levels: int = 511
    """Largest number of levels of a random telegraph before it is repeated."""
    max_frequency_share: float = 0.45
    """Highest frequency of a multisine or a sweep, as a fraction of the sample rate: just below the Nyquist
    frequency."""

    # Predictions under a candidate input
    max_reach_ratio: float = 1.5
    """Largest predicted output over the largest measured one: no device is sent further on a simulation's word."""
    initial_state_steps: int = 3
    """Gauss-Newton steps of a rival's initial state towards the prediction of the candidate that is taken as true."""

    # Design
    deciding_separation: float = 8.0
    """Separation of two candidates [standard errors] from which a design decides. Where the data so far do not prefer
    one of them, 98 % of records that bring 6 leave one candidate by `SearchThresholds.equivalent_bic`; but the
    difference is predicted no better than these few data determine it, and its square enters."""
    max_records: int = 16
    """Largest number of records of a design; proposed where fewer do not decide."""
    alike_separation: float = 0.1
    """Separation by one record [standard errors] below which two candidates answer an input alike."""
