"""The VO2 microactuator as a kind of plant."""

from rtctl.border import records
from rtctl.registry.plant_kind import Control, Defaults, Identification, ModelFiles, PlantKind, SignalKind

VO2 = PlantKind(
    name="vo2",
    summary="VO2 microactuator that senses itself by its film's resistance",
    profile=records.VO2,
    signals={
        "current": SignalKind(role="input", unit="mA"),
        "resistance": SignalKind(role="output", unit="ohm"),
        "deflection": SignalKind(role="output", unit="um", optional=True),
    },
    model=ModelFiles(
        read="rtctl.models.vo2:read_model",
        write="rtctl.models.vo2:save_model",
        simulation="rtctl.simulations.vo2:vo2_simulation",
        mechanisms="rtctl.simulations.vo2:MECHANISMS",
        mechanism_type="rtctl.simulations.vo2.mechanism:Vo2Mechanism",
        dynamics="rtctl.simulations.vo2.branch:vo2_dynamics",
        c_plant="rtctl.simulations.vo2.c_source.plant:vo2_plant",
    ),
    control=Control(support="rtctl.plants.vo2.control:Vo2Support"),
    identification=Identification(
        fit="rtctl.api.identifying.fit_vo2:fit_vo2",
        options="rtctl.identification.vo2.identify:Vo2FitOptions",
        option_names={"starts": "starts", "seed": "seed", "plays": "plays", "cells": "fine_cells"},
        excitation="acquire_vo2",
    ),
    belief="rtctl.plants.vo2.doubt.free_run:Vo2Belief",
    retuned="rtctl.plants.vo2.doubt.retuned:retuned_model",
    diagnosis="rtctl.plants.vo2.diagnosis:SUBJECTS",
    device_file="plant_sim.vo2:load_plant",
    defaults=Defaults(
        limits={"low": 3.68, "high": 8.49, "sensed_low": 100.0, "sensed_high": 10.0e6},
        frozen_after=20,
        device="vo2_a",
        estimator="observer",
        controller="pi",
    ),
)
