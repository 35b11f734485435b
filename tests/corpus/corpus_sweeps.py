"""Frequency responses: magnitudes in decibels, RMS and peak to peak, phases in two units, and their neighbours in time."""

from __future__ import annotations

import numpy as np
from corpus_case import ROWS, SWEEP, RightSweep, Situation, T, U, X, refused, table, text
from corpus_case import Right as InTime

F, DRIVE, Z = SWEEP
MAG, LEVEL, DEG, RAD = np.abs(Z), 20.0 * np.log10(np.abs(Z)), np.rad2deg(np.angle(Z)), np.angle(Z)
ROOT2 = np.sqrt(2.0)
RIGHT = RightSweep()
LOGARITHM = "a logarithm"


def swept(header: str, drive: np.ndarray = DRIVE, magnitude: np.ndarray = MAG, phase: np.ndarray = DEG):
    return text(header + "\n" + table(F, drive, magnitude, phase, form="{:.9g}"))


def turned(header: str, frequency: np.ndarray):
    return text(header + "\n" + table(frequency, DRIVE, MAG, DEG, form="{:.12g}"))


SITUATIONS = (
    Situation("a sweep in rad/s", turned("omega (rad/s),Drive (V),Mag (um),Phase (deg)", 2.0 * np.pi * F), RIGHT),
    Situation("a sweep in rad/s that is called a frequency", turned("frequency (rad/s),Drive (V),Mag (um),Phase (deg)", 2.0 * np.pi * F), RIGHT),
    Situation("a sweep in rpm", turned("speed (rpm),Drive (V),Mag (um),Phase (deg)", 60.0 * F), RIGHT),
    Situation("a sweep, plain", swept("f (Hz),Drive (V),Mag (um),Phase (deg)"), RIGHT),
    Situation("a sweep in dB of a reference", swept("f (Hz),Drive (V pk),Mag (dB re 1 um pk),Phase (deg)", magnitude=LEVEL), RIGHT),
    Situation("a sweep in dB, peak or RMS untold", swept("f (Hz),Drive (V),Mag (dB re 1 um),Phase (deg)", magnitude=LEVEL), RightSweep(remark="peak or RMS")),
    Situation("a sweep in dB of a reference of 20", swept("f (Hz),Drive (V),Mag (dB re 20 nm),Phase (deg)", magnitude=LEVEL - 20.0 * np.log10(0.02)), RIGHT),
    Situation("a sweep in dB behind the name", swept("f_Hz,drive_V,mag dB re 1 um,phase_deg", magnitude=LEVEL), RIGHT),
    Situation("a sweep in dB of no reference", swept("f (Hz),Drive (V),Mag (dB),Phase (deg)", magnitude=LEVEL), refused("r.csv", "Mag (dB)", "what 0 dB is", "dB re 1 um")),
    Situation("a sweep in dB of no reference, by its name", swept("f (Hz),Drive (V),mag_dB,Phase (deg)", magnitude=LEVEL), refused("r.csv", "mag_dB", "what 0 dB is", "dB re 1 um")),
    Situation("a sweep in dB whose reference is said", swept("f (Hz),Drive (V),Mag (dB),Phase (deg)", magnitude=LEVEL), RIGHT, {"outputs": {"displacement": "Mag (dB):dB re 1 um"}}),
    Situation("a sweep in dBm", swept("f (Hz),Drive (V),Mag (dBm),Phase (deg)", magnitude=LEVEL), refused("r.csv", "Mag (dBm)", "what 0 dB is")),
    Situation("a drive in dBV", swept("f (Hz),Drive (dBV),Mag (um rms),Phase (deg)", 20.0 * np.log10(DRIVE / ROOT2), MAG / ROOT2), RIGHT),
    Situation("a sweep in RMS", swept("f (Hz),Drive (V rms),Mag (um rms),Phase (deg)", DRIVE / ROOT2, MAG / ROOT2), RIGHT),
    Situation("a drive in RMS, the response untold", swept("f (Hz),Drive (Vrms),Mag (um),Phase (deg)", DRIVE / ROOT2), RightSweep(remark="peak or RMS")),
    Situation("a sweep peak to peak", swept("f (Hz),Drive (Vpp),Mag (um pk-pk),Phase (deg)", 2.0 * DRIVE, 2.0 * MAG), RIGHT),
    Situation("a sweep in RMS by its names", swept("f (Hz),Drive RMS (V),Mag RMS (um),Phase (deg)", DRIVE / ROOT2, MAG / ROOT2), RIGHT),
    Situation("a sweep with the phase in rad", swept("f (Hz),Drive (V),Mag (um),Phase (rad)", phase=RAD), RIGHT),
    Situation("a sweep with the phase from 0 to 360", swept("f (Hz),Drive (V),Mag (um),Phase (deg)", phase=DEG % 360.0), RIGHT),
    Situation("a sweep with a phase that goes on", swept("f (Hz),Drive (V),Mag (um),Phase (rad)", phase=RAD - 6.0 * np.pi), RIGHT),
    Situation("a sweep with the phase in mrad", swept("f (Hz),Drive (V),Mag (um),Phase (mrad)", phase=1e3 * RAD), refused("r.csv", "Phase (mrad)", "degrees or radians")),
    Situation("a sweep without phase", text("f (Hz),Drive (V),Mag (um)\n" + table(F, DRIVE, MAG, form="{:.9g}")), refused("r.csv", "Mag (um)", "without a phase")),
    Situation("a sweep without phase in dB", text("f (Hz),Drive (V),Mag (dB re 1 um)\n" + table(F, DRIVE, LEVEL, form="{:.9g}")), refused("r.csv", "Mag (dB re 1 um)", "without a phase")),
    Situation("a lock-in that gives RMS", text("f (Hz),Drive (Vrms),X (um rms),Y (um rms)\n" + table(F, DRIVE / ROOT2, Z.real / ROOT2, Z.imag / ROOT2, form="{:.9g}")), RIGHT),
    Situation("a sweep in dB taken as one in time", swept("f (Hz),Drive (V),Mag (dB re 1 um),Phase (deg)", magnitude=LEVEL), refused("r.csv", "Mag (dB re 1 um)", LOGARITHM), {"sample_rate_hz": 1.0, "outputs": {"displacement": "Mag (dB re 1 um):um"}}),
    Situation("decibels of a reference in time", text("t [s],u [V],x [dB re 1 mm]\n" + table(T, U, X)), refused("r.csv", "x [dB re 1 mm]", LOGARITHM)),
    Situation("decibels in time that are said to be mm", text("t [s],u [V],x_dB\n" + table(T, U, X)), refused("r.csv", "x_dB", LOGARITHM), {"outputs": {"displacement": "x_dB:mm"}}),
    Situation("a drive in V pk in time", text("t [s],u [V pk],x [mm]\n" + table(T, U, X)), InTime(remark="readings at instants")),
    Situation("a drive in V rms in time", text("t [s],u [V rms],x [mm]\n" + table(T, U, X)), refused("r.csv", "u [V rms]", "no reading at an instant")),
    Situation("a dead band is no decibel", text("t [s],u_db [V],x [mm]\n" + table(T, U, X)), InTime(rows=ROWS)),
)  # fmt: skip
