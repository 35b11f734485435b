"""A functional mock-up unit as a kind of plant: a device behind a wire, whose channels the unit names."""

from rtctl.border.records import device_profile
from rtctl.registry.plant_kind import PlantKind

FMU = PlantKind(
    name="fmu",
    summary="functional mock-up unit (FMI 2.0 or 3.0, co-simulation), as a device",
    profile=device_profile(  # a stand-in: each device has the channels of its unit
        "fmu",
        commands={"input": "dimensionless"},
        sensed={"output": "dimensionless"},
        reference=("reference_output", "dimensionless"),
    ),
    device_file="plant_sim.fmu.plant:load_plant",
    device_profile="plant_sim.fmu.plant:read_profile",
)
