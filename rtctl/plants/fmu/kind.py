"""A functional mock-up unit as a kind of plant: a device behind a wire, and a model that is fitted and doubted."""

from rtctl.border.records import device_profile
from rtctl.plants.equations.kind import IDENTIFICATION
from rtctl.registry.plant_kind import ModelFiles, PlantKind

FMU = PlantKind(
    name="fmu",
    summary="functional mock-up unit (FMI 2.0 or 3.0, co-simulation)",
    profile=device_profile(  # a stand-in: each device has the channels of its unit
        "fmu",
        commands={"input": "dimensionless"},
        sensed={"output": "dimensionless"},
        reference=("reference_output", "dimensionless"),
    ),
    free_signals=True,
    model=ModelFiles(
        read="plant_sim.fmu.reading:read_fmu_model",
        write="rtctl.plants.fmu.writing:write_fmu_model",
        simulation="plant_sim.fmu.simulation:fmu_simulation",
        is_device=True,
    ),
    identification=IDENTIFICATION,
    diagnosis="rtctl.plants.fmu.diagnosis:fmu_subject",
    device_file="plant_sim.fmu.plant:load_plant",
    device_profile="plant_sim.fmu.plant:read_profile",
)
