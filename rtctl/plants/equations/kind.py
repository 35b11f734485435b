"""Equations of a user as a kind of plant; its signals are those that the model names."""

from rtctl.border.records import device_profile
from rtctl.registry.plant_kind import Control, Defaults, Identification, ModelFiles, PlantKind

IDENTIFICATION = Identification(
    fit="rtctl.api.identifying.fit_equations:fit_equations",
    options="rtctl.identification.equations.identify:EquationsFitOptions",
    option_names={"starts": "starts", "seed": "seed"},
    takes_model=True,
)
"""Of models whose signals, states and parameters their user has named: of units (FMU) too."""
EQUATIONS = PlantKind(
    name="equations",
    summary="equations of your own, with units",
    profile=device_profile(  # a stand-in: each device has the channels of its model
        "equations",
        commands={"input": "dimensionless"},
        sensed={"output": "dimensionless"},
        reference=("reference_output", "dimensionless"),
    ),
    free_signals=True,
    model=ModelFiles(
        read="plant_sim.equations.reading:read_equations",
        write="rtctl.models.provenance:write_checked_model",
        simulation="plant_sim.equations.model:equations_simulation",
        dynamics="plant_sim.equations.exported.dynamics:equations_dynamics",
        matlab_function="plant_sim.equations.exported.matlab:equations_function",
        c_plant="plant_sim.equations.c_source.plant:equations_plant",
        is_device=True,
    ),
    identification=IDENTIFICATION,
    control=Control(
        support="rtctl.plants.equations.control:EquationsSupport",
        several="rtctl.plants.equations.several:with_further_outputs",
    ),
    diagnosis="rtctl.plants.equations.diagnosis:equations_subject",
    device_file="plant_sim.equations.plant:load_plant",
    device_profile="plant_sim.equations.device_profile:read_profile",
    defaults=Defaults(estimator="none", controller="pid"),
)
