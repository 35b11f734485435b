"""`modelDescription.xml` and `buildDescription.xml` of a functional mock-up unit, FMI 3.0 and 2.0."""

from __future__ import annotations

from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from rtctl.border.exported.c_plant import CPlant
from rtctl.export.fmu.units import add_unit_definitions
from rtctl.export.fmu.variables import INPUTS, OUTPUTS, SLOPES, STATES, FmuVariable
from rtctl.version import __version__

CAPABILITIES = {
    "canHandleVariableCommunicationStepSize": "true",
    "canBeInstantiatedOnlyOncePerProcess": "false",
}
STEPS_OF_AN_EXPERIMENT = 1000


class Described(NamedTuple):
    """What a description tells of a unit."""

    plant: CPlant
    name: str
    """Name of the model for people."""
    identifier: str
    """Name of its binary, a C identifier."""
    token: str
    """What tells this unit from others: its hash."""
    step_s: float
    """Communication step that is proposed [s]."""
    variables: tuple[FmuVariable, ...]
    sources: tuple[str, ...]
    """Names of the C files that are compiled."""


def model_description(unit: Described, version: str) -> str:
    """Return `modelDescription.xml` of a unit for FMI `version`, "3.0" or "2.0"."""
    return _text(_description_3(unit) if version == "3.0" else _description_2(unit))


def build_description(unit: Described) -> str:
    """Return `sources/buildDescription.xml` of FMI 3.0."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    build = SubElement(
        root, "BuildConfiguration", modelIdentifier=unit.identifier, description="any C99 compiler"
    )
    files = SubElement(build, "SourceFileSet", language="C99", compilerOptions="-ffp-contract=off")
    for name in unit.sources:
        SubElement(files, "SourceFile", name=name)
    SubElement(build, "Library", name="m")
    return _text(root)


def _description_3(unit: Described) -> Element:
    root = Element(
        "fmiModelDescription", fmiVersion="3.0", modelName=unit.name, instantiationToken=unit.token,
        description=_sentence(unit), generationTool=f"rtctl {__version__}", variableNamingConvention="structured",
    )  # fmt: skip
    SubElement(
        root, "CoSimulation",
        {
            "modelIdentifier": unit.identifier, "canGetAndSetFMUState": "true", "canSerializeFMUState": "true",
            "providesDirectionalDerivatives": "false", "hasEventMode": "false", **CAPABILITIES,
        },
    )  # fmt: skip
    add_unit_definitions(root, [one.variable.unit for one in unit.variables])
    _add_experiment(root, unit)
    listed = SubElement(root, "ModelVariables")
    for one in unit.variables:
        attributes = {
            "name": one.name,
            "valueReference": str(one.reference),
            **_behaviour(one),
            **_bounds(one),
        }
        SubElement(listed, "Float64", attributes)
    structure = SubElement(root, "ModelStructure")
    inputs = {one.name: one for one in unit.variables if one.section in (INPUTS, SLOPES)}
    for one in unit.variables:
        if one.section is OUTPUTS:
            references = " ".join(str(inputs[name].reference) for name in inputs if _reaches(unit, one, name))
            SubElement(structure, "Output", valueReference=str(one.reference), dependencies=references)
    for one in unit.variables:
        if one.section is OUTPUTS:
            SubElement(structure, "InitialUnknown", valueReference=str(one.reference))
    return root


def _description_2(unit: Described) -> Element:
    root = Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=unit.name, guid=unit.token, description=_sentence(unit),
        generationTool=f"rtctl {__version__}", variableNamingConvention="structured", numberOfEventIndicators="0",
    )  # fmt: skip
    co_simulation = SubElement(
        root, "CoSimulation",
        {
            "modelIdentifier": unit.identifier, "canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true",
            "providesDirectionalDerivative": "false", "canInterpolateInputs": "true",
            "maxOutputDerivativeOrder": "0", "canRunAsynchronuously": "false",
            "canNotUseMemoryManagementFunctions": "true", **CAPABILITIES,
        },
    )  # fmt: skip
    files = SubElement(co_simulation, "SourceFiles")
    for name in unit.sources:
        SubElement(files, "File", name=name)
    add_unit_definitions(root, [one.variable.unit for one in unit.variables])
    _add_experiment(root, unit)
    listed = SubElement(root, "ModelVariables")
    for one in unit.variables:
        attributes = _behaviour(one)
        start = {"start": attributes.pop("start")} if "start" in attributes else {}
        scalar = SubElement(
            listed,
            "ScalarVariable",
            {"name": one.name, "valueReference": str(one.reference), **_without_unit(attributes)},
        )
        SubElement(scalar, "Real", {"unit": one.variable.unit, **_bounds(one), **start})
    structure = SubElement(root, "ModelStructure")
    inputs = {one.name: one for one in unit.variables if one.section in (INPUTS, SLOPES)}
    outputs = SubElement(structure, "Outputs")
    for one in unit.variables:
        if one.section is OUTPUTS:
            indices = " ".join(
                str(inputs[name].reference + 1) for name in inputs if _reaches(unit, one, name)
            )
            SubElement(outputs, "Unknown", index=str(one.reference + 1), dependencies=indices)
    unknowns = SubElement(structure, "InitialUnknowns")
    for one in unit.variables:
        if one.section is OUTPUTS:
            SubElement(unknowns, "Unknown", index=str(one.reference + 1))
    return root


def _behaviour(one: FmuVariable) -> dict[str, str]:
    """Return causality, variability, meaning, unit and start value."""
    made = {"causality": one.section.causality, "variability": one.section.variability}
    if one.variable.meaning:
        made["description"] = one.variable.meaning
    if one.section in (OUTPUTS, STATES):
        made["initial"] = "calculated"
    made["unit"] = one.variable.unit
    if not one.is_computed:
        made["start"] = repr(float(one.variable.value))
    return made


def _without_unit(attributes: dict[str, str]) -> dict[str, str]:
    return {name: value for name, value in attributes.items() if name != "unit"}


def _bounds(one: FmuVariable) -> dict[str, str]:
    bounds = {"min": one.variable.low, "max": one.variable.high}
    return {name: repr(float(value)) for name, value in bounds.items() if value is not None}


def _reaches(unit: Described, output: FmuVariable, name: str) -> bool:
    """Return whether an output depends on an input at the same instant."""
    return name in unit.plant.direct[output.index]


def _add_experiment(root: Element, unit: Described) -> None:
    stop = repr(STEPS_OF_AN_EXPERIMENT * unit.step_s)
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime=stop, stepSize=repr(unit.step_s))


def _sentence(unit: Described) -> str:
    plant = unit.plant
    extended = f", extended by {', '.join(plant.mechanisms)}" if plant.mechanisms else ""
    return (
        f"model of kind {plant.kind}{extended}; {plant.method}, steps of at most {plant.longest_step_s:.6g} s"
    )


def _text(root: Element) -> str:
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"
