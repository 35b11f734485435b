"""The oscillator as a kind of plant: identified and diagnosed, without a controller of its own."""

from rtctl.border import records
from rtctl.registry.plant_kind import Identification, ModelFiles, PlantKind, SignalKind

BASE = (
    "the input is the acceleration of the base, which is the drive of the model: where the response is relative to the "
    "base and nothing else drives, drive_gain is minus one acceleration for each (-1000 mm/s^2 for 1 m/s^2)"
)

OSCILLATOR = PlantKind(
    name="oscillator",
    summary="oscillator with one degree of freedom",
    profile=records.OSCILLATOR,
    units_from={
        "drive_unit": ("drive",),
        "displacement_unit": ("displacement", "reference_displacement"),
    },
    signals={
        "drive": SignalKind(role="input", not_in=("g",)),
        "base_acceleration": SignalKind(
            role="input", like="m/s^2", not_in=("g",), stands_for="drive", remark=BASE
        ),
        "displacement": SignalKind(role="output", not_in=("g", "m/s", "m/s^2", "N"), optional=True),
        "velocity": SignalKind(role="output", derivative_of="displacement", not_in=("g", "N"), optional=True),
        "acceleration": SignalKind(
            role="output", derivative_of="displacement", derivatives=2, not_in=("g", "N"), optional=True
        ),
    },
    responses=("displacement", "velocity", "acceleration"),
    has_sweeps=True,
    initial=("displacement", "velocity"),
    model=ModelFiles(
        read="rtctl.models.oscillator:read_oscillator_model",
        write="rtctl.models.provenance:write_checked_model",
        simulation="plant_sim.oscillator.model:simulation_of_data",
        mechanisms="plant_sim.oscillator.mechanisms:MECHANISMS",
        mechanism_type="plant_sim.oscillator.mechanism:OscillatorMechanism",
        is_device=True,
        dynamics="plant_sim.oscillator.dynamics:oscillator_dynamics",
        c_plant="plant_sim.oscillator.c_source.plant:oscillator_plant",
        forced="plant_sim.oscillator.forced:forced_model",
    ),
    identification=Identification(
        fit="rtctl.api.identifying.fit_oscillator:fit_oscillator",
        options="rtctl.identification.oscillator.identify:OscillatorFitOptions",
        option_names={"starts": "starts", "seed": "seed"},
        takes_model=True,
    ),
    diagnosis="rtctl.plants.oscillator.diagnosis:SUBJECTS",
    device_file="plant_sim.oscillator.plant:load_plant",
)
