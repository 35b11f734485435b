"""The magnetoelectric resonator as a kind of plant: controlled, but neither identified nor diagnosed as such."""

from rtctl.border import records
from rtctl.registry.plant_kind import Control, Defaults, PlantKind

ME = PlantKind(
    name="me",
    summary="magnetoelectric resonator, read by a lock-in amplifier",
    profile=records.ME,
    control=Control(support="rtctl.plants.me.control:MeSupport"),
    device_file="plant_sim.resonator.load:load_plant",
    defaults=Defaults(estimator="lock_in", controller="agc_pll"),
)
