"""The registry: names of plants, drivers, estimators, controllers and mechanisms, those of the user beside ours."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args, overload

from rtctl.border.errors import InputError, nearest
from rtctl.border.importing import import_object
from rtctl.registry.builtin import TABLES
from rtctl.registry.checks import check_class
from rtctl.registry.loading import (
    announce_plugin,
    announced_plugins,
    forget_plugin,
    import_plugin,
    resolved,
)
from rtctl.registry.plant_kind import PlantKind

Part = Literal["plant", "driver", "estimator", "controller", "mechanism"]
PARTS: tuple[Part, ...] = get_args(Part)
OURS = "rtctl"
ValueT = TypeVar("ValueT")


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A registered part."""

    part: Part
    name: str
    value: Any
    """The object, or "module:attribute" of one that has not been imported yet."""
    plants: tuple[str, ...] = ()
    """Kinds of plant that it is for; empty: all."""
    origin: str = OURS
    """"rtctl", or where a part of the user was registered: a file, a module, a distribution."""
    summary: str = ""

    @property
    def is_own(self) -> bool:
        """Whether the part is the user's."""
        return self.origin != OURS

    def fits(self, plant: str | None) -> bool:
        """Whether the part is for this kind of plant; None: any."""
        return plant is None or not self.plants or plant in self.plants


class _Registry:
    """The parts of the user, and which sources of them were looked at."""

    def __init__(self) -> None:
        self.own: dict[tuple[Part, str], Entry] = {}
        self.origin: str | None = None  # of what is being imported
        self.looked_at: set[Part] = set()  # groups of entry points
        self.imported_plugins: set[Path] = set()


_registry = _Registry()


@overload
def register(
    part: Part, name: str, value: ValueT, *, plants: str | Iterable[str] = (), summary: str = ""
) -> ValueT: ...


@overload
def register(
    part: Part, name: str, *, plants: str | Iterable[str] = (), summary: str = ""
) -> Callable[[ValueT], ValueT]: ...


def register(
    part: Part, name: str, value: Any = None, *, plants: str | Iterable[str] = (), summary: str = ""
) -> Any:
    """Make a part of your own known by a name, beside those that come with the program.

    Registered parts are named in scenarios (`controller.kind`, `estimator.kind`, `driver.kind`, `driver.device`,
    `scenario.plant`), in model files (`id` of a mechanism), and by `rtctl list`. Without `value` this is a decorator:

        @rtctl.register("controller", "mine")
        class MyController: ...

    Args:
        part: "plant", "driver", "estimator", "controller" or "mechanism".
        name: name in files; a mechanism's is its id.
        value: of a controller, estimator or driver its class, or a function that returns an object of it; of a plant a
            `PlantKind`, or the class of a simulated device with a `profile`; a mechanism as an object.
        plants: kinds of plant that it is for; default: all, and of a mechanism those of its type.
        summary: one line for `rtctl list`; default: the first line of the docstring.

    Returns:
        `value`, unchanged.

    Raises:
        InputError: the name is taken, `part` is unknown, or a method of the part's protocol is missing.
    """
    kinds = (plants,) if isinstance(plants, str) else tuple(plants)
    if part not in PARTS:
        raise InputError(f'register: there is no part "{part}"{nearest(str(part), PARTS)}')
    if not isinstance(name, str) or not name or ":" in name:
        raise InputError(f'register: a {part} needs a name without ":", got {name!r}')
    if value is None:
        return lambda decorated: register(part, name, decorated, plants=kinds, summary=summary)
    _refuse_taken(part, name, value)
    stored = _checked(part, name, value)
    entry = Entry(
        part=part, name=name, value=stored, plants=kinds, origin=_registry.origin or _origin_of(value),
        summary=summary or _first_line(value),
    )  # fmt: skip
    _registry.own[part, name] = _with_mechanism_kinds(entry) if part == "mechanism" else entry
    return value


def entries(part: Part, plant: str | None = None) -> tuple[Entry, ...]:
    """Return all parts of a sort, ours first; those for a kind of plant where one is given."""
    ours = [
        Entry(part=part, name=name, value=one.target, plants=one.plants, summary=one.summary)
        for name, one in TABLES[part].items()
    ]
    own = [entry for (kind, _), entry in _own_parts(part).items() if kind == part]
    return tuple(entry for entry in (*ours, *own) if entry.fits(plant))


def names(part: Part, plant: str | None = None) -> tuple[str, ...]:
    """Return the names of `entries`."""
    return tuple(entry.name for entry in entries(part, plant))


def find(part: Part, name: str, key: str = "") -> Entry:
    """Return the part of this name, or the class that "module:Class" names.

    Args:
        part: sort of part.
        name: registered name, or "module:Class".
        key: key of the file that has the name, for the message.

    Raises:
        InputError: there is no such part, or it does not import, or lacks a method.
    """
    where = f'key "{key}"' if key else part
    if ":" in name:
        value = import_object(name, where)
        return Entry(part=part, name=name, value=_checked(part, name, value), origin=name.partition(":")[0])
    for entry in entries(part):
        if entry.name == name:
            return entry
    known = names(part)
    raise InputError(f'{where}: unknown {part} "{name}"{nearest(name, known)}')


def load(entry: Entry) -> Any:
    """Return the object of `entry`, imported and checked where that was not done yet. Raises InputError."""
    if not isinstance(entry.value, str):
        return entry.value
    value = resolved(entry.value, f'{entry.part} "{entry.name}" of {entry.origin}')
    return _checked(entry.part, entry.name, value) if entry.is_own else value


def load_plugin(path: str | Path) -> None:
    """Import a Python file that registers parts of its own, here and in worker processes. Raises InputError."""
    file = Path(path)
    _import_plugin(file)
    announce_plugin(file)


@contextmanager
def forgetting() -> Iterator[None]:
    """Forget what is registered inside the block at its end (for tests and notebooks)."""
    before, plugins = dict(_registry.own), set(_registry.imported_plugins)
    _registry.looked_at.clear()
    try:
        yield
    finally:
        _registry.looked_at.clear()
        for path in _registry.imported_plugins - plugins:
            forget_plugin(path)
        _registry.imported_plugins = plugins
        for key in _registry.own.keys() - before.keys():
            entry = _registry.own[key]
            if entry.part == "mechanism":
                for plant in entry.plants:
                    _catalogue_of(plant).pop(entry.name, None)
        _registry.own = before


def plant_kind(name: str, key: str = "scenario.plant") -> PlantKind:
    """Return the kind of plant of this name. Raises InputError where there is none."""
    found: PlantKind = load(find("plant", name, key))
    return found


def plant_kinds() -> dict[str, PlantKind]:
    """Return all kinds of plant by name, ours first."""
    return {entry.name: load(entry) for entry in entries("plant")}


def mechanisms_of(kind: str) -> dict[str, Any]:
    """Return the mechanisms of a kind of plant by id, in the order of its catalogue, the user's last.

    Raises:
        InputError: there is no such kind, or it has no mechanisms.
    """
    _own_parts("mechanism")  # those of entry points enter the catalogue when they are looked at
    catalogue = _catalogue_of(kind)
    if catalogue is None:
        with_some = [name for name, one in plant_kinds().items() if one.model and one.model.mechanisms]
        raise InputError(
            f'a model of kind "{kind}" has no mechanisms to choose from{nearest(kind, with_some)}'
        )
    return dict(catalogue)


def _own_parts(part: Part) -> dict[tuple[Part, str], Entry]:
    """Return the user's parts, those of announced plugins and of the entry points of this sort included."""
    for path in announced_plugins():
        if path not in _registry.imported_plugins:
            _import_plugin(path)
    if part not in _registry.looked_at:
        _registry.looked_at.add(part)  # before: what is imported now may look again
        try:
            _add_entry_points(part)
        except InputError:
            _registry.looked_at.discard(part)
            raise
    return _registry.own


def _import_plugin(path: Path) -> None:
    before = _registry.origin
    _registry.origin = str(path)
    _registry.imported_plugins.add(path.resolve())
    try:
        import_plugin(path)
    except InputError:
        _registry.imported_plugins.discard(path.resolve())
        raise
    finally:
        _registry.origin = before


def _add_entry_points(part: Part) -> None:
    """Add what installed distributions offer of one sort; all but mechanisms are imported when they are used."""
    for point in entry_points(group=f"rtctl.{part}s"):
        origin = point.dist.name if point.dist is not None else point.module
        if (part, point.name) in _registry.own and _registry.own[part, point.name].origin == origin:
            continue
        _refuse_taken(part, point.name, point.value)
        entry = Entry(part=part, name=point.name, value=point.value, origin=origin)
        if part == "mechanism":
            value = load(entry)
            entry = _with_mechanism_kinds(
                Entry(part=part, name=point.name, value=value, origin=origin, summary=_first_line(value))
            )
        _registry.own[part, point.name] = entry


def _refuse_taken(part: Part, name: str, value: Any) -> None:
    """Raise InputError where another part has this name already."""
    if name in TABLES[part]:
        raise InputError(f'{part} "{name}": the name is taken by a part of rtctl; choose another one')
    if (
        part == "mechanism"
        and (part, name) not in _registry.own
        and any(name in (_catalogue_of(kind) or {}) for kind in TABLES["plant"])
    ):
        raise InputError(f'mechanism "{name}": the id is taken by a mechanism of rtctl; choose another one')
    known = _registry.own.get((part, name))
    if known is not None and known.value is not value and not _is_reimported(known.value, value):
        raise InputError(f'{part} "{name}": the name is taken by one of {known.origin}; choose another one')


def _is_reimported(known: Any, value: Any) -> bool:
    """Whether `value` is a new version of `known`, as when a notebook's cell is run again."""
    names = [(getattr(one, "__module__", None), getattr(one, "__qualname__", None)) for one in (known, value)]
    return None not in names[0] and names[0] == names[1]


def _checked(part: Part, name: str, value: Any) -> Any:
    """Return what is stored of `value`. Raises InputError where it is no such part."""
    if part == "plant":
        return _plant_of(name, value)
    if part == "mechanism":
        from rtctl.border.mechanisms import Mechanism

        if not isinstance(value, Mechanism):
            raise InputError(f'mechanism "{name}": a Mechanism is needed, got {value!r}')
        if value.id != name:
            raise InputError(f'mechanism "{name}": its id is "{value.id}"; register it by its id')
        return value
    check_class(part, name, value)
    return value


def _plant_of(name: str, value: Any) -> PlantKind:
    """Return the kind of plant that `value` is, or that the class of a simulated device `value` describes."""
    if isinstance(value, PlantKind):
        if ":" not in name and value.name != name:
            raise InputError(f'plant "{name}": the PlantKind has the name "{value.name}"; give both the same')
        return value
    check_class("plant", name, value)
    profile = getattr(value, "profile", None)
    from rtctl.border.records import DeviceProfile

    if not isinstance(profile, DeviceProfile):
        raise InputError(
            f'plant "{name}": {getattr(value, "__qualname__", value)} lacks the class attribute profile: a '
            "DeviceProfile with its commands, readings and reference"
        )
    kind = profile.kind if ":" in name else name
    if profile.kind != kind:
        raise InputError(f'plant "{name}": its profile is of kind "{profile.kind}"; give both the same name')
    return PlantKind(name=kind, summary=_first_line(value), profile=profile, device=value)


def _with_mechanism_kinds(entry: Entry) -> Entry:
    """Put a mechanism into the catalogues of its kinds of plant, and return it with their names."""
    kinds = entry.plants or tuple(
        kind.name
        for kind in plant_kinds().values()
        if kind.model is not None
        and kind.model.mechanism_type is not None
        and isinstance(entry.value, kind.part(kind.model.mechanism_type))
    )
    if not kinds:
        raise InputError(
            f'mechanism "{entry.name}": a {type(entry.value).__name__} is of no kind of plant; say which by plants='
        )
    for kind in kinds:
        catalogue, needed = _catalogue_of(kind), plant_kind(kind, "plants").model
        if catalogue is None or needed is None:
            raise InputError(f'mechanism "{entry.name}": a "{kind}" has no catalogue of mechanisms')
        wanted = plant_kind(kind).part(needed.mechanism_type) if needed.mechanism_type else object
        if not isinstance(entry.value, wanted):
            raise InputError(
                f'mechanism "{entry.name}": a "{kind}" needs a {wanted.__name__}, got a {type(entry.value).__name__}'
            )
        catalogue[entry.name] = entry.value
    return Entry(
        part=entry.part,
        name=entry.name,
        value=entry.value,
        plants=kinds,
        origin=entry.origin,
        summary=entry.summary,
    )


def _catalogue_of(kind: str) -> Any:
    """Return the mutable catalogue of mechanisms of a kind of plant; None: it has none."""
    for entry in (*(e for e in _registry.own.values() if e.part == "plant"), *_our_plants()):
        if entry.name == kind:
            found: PlantKind = load(entry)
            return None if found.model is None else found.part(found.model.mechanisms)
    return None


def _our_plants() -> list[Entry]:
    return [Entry(part="plant", name=name, value=one.target) for name, one in TABLES["plant"].items()]


def _origin_of(value: Any) -> str:
    module = getattr(value, "__module__", None)
    return str(module) if module else type(value).__module__


def _first_line(value: Any) -> str:
    """Return the first line of the docstring, or a mechanism's statement."""
    statement = getattr(value, "statement", None) or getattr(value, "summary", None)
    if isinstance(statement, str):
        return statement
    text = value.__doc__ if isinstance(value, type) or callable(value) else None
    return (text or "").strip().partition("\n")[0]
