"""Studies: TOML files that describe a model from its geometry to the run and its plots."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fecontact.bifurcation.diagram_options import BranchSettings
from fecontact.bifurcation.response_options import ResponseSettings, flat_levels
from fecontact.core.checks import (
    as_path,
    merged,
    require_kind,
    require_regular_file,
    whole_number,
)
from fecontact.core.errors import FecontactError, InputError, choices, nearest
from fecontact.core.files.named_files import content_hashes
from fecontact.core.tables import (
    convert,
    from_table,
    key_tree,
    located,
    parsed,
    plain,
    require_readable,
    shown,
    to_table,
    with_keys,
)
from fecontact.core.units import Summarised, listed, quantity
from fecontact.fem.cyclic_symmetry import CyclicSymmetry
from fecontact.integrate.events import ContactEvents
from fecontact.integrate.initial_state import Initial
from fecontact.integrate.simulate import simulate
from fecontact.integrate.solvers import CompiledSolver
from fecontact.integrate.trajectory import Trajectory
from fecontact.integrate.wear import WearHistory, wear_history
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.excitation import Drive, Load
from fecontact.laws.ground.ground import Ground
from fecontact.laws.ground.height_map import HeightMap
from fecontact.laws.own_files import trusting, with_folder
from fecontact.laws.registry import PART_CLASSES, foreign_keys
from fecontact.measured.measurement import Measurement
from fecontact.study.assembly import LAWS, contact_system
from fecontact.study.bodies_section import (
    BodySections,
    Gap,
    InterfaceSettings,
    bodies_from_tables,
    check_bodies,
)
from fecontact.study.comments import FILES, KEYS_GIVEN, comment
from fecontact.study.fit_section import FitSettings, flat_parameters
from fecontact.study.geometry_section import (
    Geometry,
    body_table,
    geometry_from_table,
    geometry_table,
)
from fecontact.study.links_section import (
    LinkSettings,
    link_table,
    links_from_tables,
    with_stingers,
)
from fecontact.study.measurement_section import MeasurementSettings
from fecontact.study.models import StudyModels
from fecontact.study.preload_section import PreloadSettings
from fecontact.study.render_section import RenderSettings
from fecontact.study.sections import (
    BasisSettings,
    BodySettings,
    OutputSettings,
    SimulationSettings,
    WearSettings,
)
from fecontact.study.sector_section import MistuningSettings
from fecontact.study.sweep_section import SweepSettings, flat_axes
from fecontact.system.contact_system import ContactSystem
from fecontact.system.gap import Crown
from fecontact.system.model_limits import (
    implausible_bodies,
    implausible_faces,
    warn_of_limits,
)
from fecontact.system.quasistatic.history import LoadHistory

NOT_OF_THE_RUN = ("output", "render", "sweep", "fit", "mistuning")

_SECTIONS: Mapping[str, type] = {
    "body": BodySettings, "basis": BasisSettings, **PART_CLASSES,
    "simulation": SimulationSettings, "wear": WearSettings, "branch": BranchSettings,
    "response": ResponseSettings, "output": OutputSettings, "render": RenderSettings,
}

# Sections that a study may lack, and what makes their tables flat.
_OPTIONAL: Mapping[str, tuple[type, Callable[[Any], Any]]] = {
    "symmetry": (CyclicSymmetry, lambda table: table),
    "preload": (PreloadSettings, lambda table: table), "sweep": (SweepSettings, flat_axes),
    "fit": (FitSettings, flat_parameters), "mistuning": (MistuningSettings, lambda table: table),
    "measurement": (MeasurementSettings, lambda table: table),
}


@dataclass(frozen=True, repr=False)
class Study(Summarised, StudyModels):
    """A study: geometry, body, modes, laws, run and output, as in its TOML file.

    Each attribute is a section of the file, the fields of its class are the keys of the section.

    Attributes
    ----------
    geometry : Beam, Pendulum, Block, a solid or MeshFile
        ``[geometry]``: a shape and its dimensions, ``shape = "beam"``, or a mesh,
        ``file = "part.msh"``; None for several bodies.
    body : BodySettings
        ``[body]``
    basis : BasisSettings
        ``[basis]``
    normal, friction, ground, drive, load
        ``[normal]``, ... : laws, ground, drive and load (contact requires both laws, which have
        no default; ``law = "frictionless"`` is none); see
        :class:`~fecontact.ContactSystem`.
    interfaces : mapping of interface to InterfaceSettings
        ``[interfaces.NAME.normal]``, ``[interfaces.NAME.friction]``: laws of single interfaces;
        all others use ``[normal]`` and ``[friction]``. Of several bodies also their faces.
    gap : float, (n,) tuple, Crown or HeightMap
        Initial distance of the contact nodes from flat ground [m], or ``{radius, centre}`` for a
        face in the shape of an arc; written above all sections. By default that of the mesh, whose
        lowest contact node touches the ground.
    preload : PreloadSettings or None
        ``[preload]``: quasi-static loading; see :func:`fecontact.load_history`.
    simulation : SimulationSettings
        ``[simulation]``
    wear : WearSettings
        ``[wear]``
    branch : BranchSettings
        ``[branch]``
    response : ResponseSettings
        ``[response]``
    output : OutputSettings
        ``[output]``
    render : RenderSettings
        ``[render]``
    sweep : SweepSettings or None
        ``[sweep]``: many cases of this study; see :func:`fecontact.sweep`.
    fit : FitSettings or None
        ``[fit]``: parameters that are fitted to measurements; see :func:`fecontact.fit`.
    bodies : mapping of name to BodySections
        ``[bodies.NAME.geometry]``, ...: several bodies, in place of ``[geometry]``, ``[body]`` and
        ``[basis]``.
    links : mapping of name to link
        ``[links.NAME]``: what joins bodies at points or faces and does not open; ``kind = "weld"``.
    symmetry : CyclicSymmetry or None
        ``[symmetry]``: the body, or the bodies together, are one sector of a wheel.
    mistuning : MistuningSettings or None
        ``[mistuning]``: deviations of its blades.
    measurement : MeasurementSettings or None
        ``[measurement]``: virtual sensors; see :meth:`measure`.
    path : Path or None
        The study file; paths of other files are relative to it.
    content_hashes : mapping of name to str
        SHA-256 of the files that the study names, as they were when it was read.
    """

    geometry: Geometry | None = None
    body: BodySettings = field(default_factory=BodySettings)
    basis: BasisSettings = field(default_factory=BasisSettings)
    normal: NormalLaw | None = None
    friction: FrictionLaw | None = None
    interfaces: Mapping[str, InterfaceSettings] = field(default_factory=dict)
    ground: Ground = field(default_factory=Ground)
    drive: Drive = field(default_factory=Drive)
    load: Load = field(default_factory=Load)
    gap: Gap | None = None
    simulation: SimulationSettings = field(default_factory=SimulationSettings)
    wear: WearSettings = field(default_factory=WearSettings)
    branch: BranchSettings = field(default_factory=BranchSettings)
    response: ResponseSettings = field(default_factory=ResponseSettings)
    output: OutputSettings = field(default_factory=OutputSettings)
    render: RenderSettings = field(default_factory=RenderSettings)
    preload: PreloadSettings | None = None
    sweep: SweepSettings | None = None
    fit: FitSettings | None = None
    bodies: Mapping[str, BodySections] = field(default_factory=dict)
    links: Mapping[str, LinkSettings] = field(default_factory=dict)
    symmetry: CyclicSymmetry | None = None
    mistuning: MistuningSettings | None = None
    measurement: MeasurementSettings | None = None
    path: Path | None = field(default=None, compare=False)
    _keys: Mapping[str, Any] = field(default_factory=dict, compare=False)  # those of the file
    content_hashes: Mapping[str, str] = field(default_factory=dict, compare=False)

    def summary(self) -> list[tuple[str, str]]:
        """Short description: file, geometry, modes, laws and duration of the run."""
        groups = [f"own laws for {listed(list(self.interfaces))}"] if self.interfaces else []
        end = self.simulation.t_end
        laws = [type(law).__name__ for law in (self.normal, self.friction) if law is not None]
        return [
            ("file", "none" if self.path is None else self.path.name),
            *([("bodies", listed(list(self.bodies))), ("interfaces", listed(list(self.interfaces))),
               ("modes", listed([f"{one.basis.modes}" for one in self.bodies.values()]))]
              if self.bodies else
              [("geometry", type(self.geometry).__name__), ("modes", f"{self.basis.modes}"),
               ("contact nodes", f"{self.basis.contact_nodes}")]),
            ("laws", ", ".join([*laws, *groups]) or "none"),
            ("ground", quantity(self.ground.speed, "m/s")),
            ("t_end", "none" if end is None else quantity(end, "s", 5)),
            *([] if self.sweep is None else [("sweep", self.sweep.method)]),
        ]

    @classmethod
    def read(cls, path: str | Path) -> "Study":
        """Read a study file.

        Raises
        ------
        InputError
            If the file does not exist, is not TOML, has unknown sections or keys, or values of
            the wrong type or out of range.
        """
        path = as_path(path, "a study")
        require_regular_file(path, "a study")
        try:
            text = path.read_text(encoding="utf-8")
        except FileNotFoundError:
            # Compare names without suffix: equal suffixes would make all file names look similar.
            others = [other.stem for other in path.parent.glob("*.toml")]
            hint = nearest(path.stem, others).replace("'?", ".toml'?")
            raise InputError(f"{path} does not exist{hint}; fecontact init writes a study to start "
                             f"from.") from None
        except UnicodeDecodeError as error:
            line = error.object.count(b"\n", 0, error.start) + 1
            raise InputError(f"{path} cannot be read as a study: line {line} is not in UTF-8; save "
                             f"the file as text in this encoding.") from None
        except OSError:
            raise InputError(f"{path} cannot be read as a study; give a text file in "
                             f"TOML.") from None
        return cls.from_toml(text, path)

    @classmethod
    def from_toml(cls, text: str, path: str | Path | None = None) -> "Study":
        """Read a study from TOML text; ``path`` is the file it stands for, see :meth:`read`."""
        path = None if path is None else as_path(path, "a study")
        require_kind(_title(path), str, text=text)
        study = cls.from_tables(parsed(text, _title(path)), path)
        return replace(study, _keys=comment(text, KEYS_GIVEN, study._keys),
                       content_hashes=comment(text, FILES, study.content_hashes))

    @classmethod
    def from_tables(cls, tables: Mapping[str, Any], path: Path | None = None) -> "Study":
        """Read a study from the parsed tables of a TOML file; see :meth:`read`."""
        title = _title(path)
        folder = Path() if path is None else path.parent
        if not isinstance(tables, Mapping):
            raise InputError(f"{title} must be a table of sections, not {shown(tables)}.")
        require_readable(tables, title)
        tables = {name: table if name in ("geometry", "bodies") else with_folder(table, folder)
                  for name, table in tables.items()}
        if "response" in tables:
            tables["response"] = flat_levels(tables["response"])
        for name in tables:
            if name == "contact":
                raise InputError(f"{title} has an unknown section 'contact'; laws of single "
                                 f"interfaces stand in [interfaces.NAME.normal] and "
                                 f"[interfaces.NAME.friction].")
            if name not in (valid := ("gap", "geometry", "bodies", "interfaces", "links",
                                      *_OPTIONAL, *_SECTIONS)):
                raise InputError(f"{title} has an unknown section or key '{name}'"
                                 f"{nearest(name, valid)}; there are: {choices(valid)}.")
        if "bodies" in tables:
            for name in ("geometry", "body", "basis"):
                if tables.get(name):
                    raise InputError(f"{title} has [{name}], which is for a single body, together "
                                     f"with [bodies]; give [bodies.NAME.{name}] to each body.")
        elif "geometry" not in tables:
            raise InputError(f"{title} lacks the section [geometry]; give a shape and its "
                             f"dimensions, or the file of a mesh. For several bodies, give "
                             f"[bodies.NAME.geometry] to each.")
        study = cls(
            geometry_from_table(tables["geometry"], f"{title}: [geometry]")
            if "bodies" not in tables else None,
            bodies=bodies_from_tables(tables["bodies"], title) if "bodies" in tables else {},
            links=links_from_tables(tables.get("links", {}), title),
            gap=_gap(tables["gap"], title) if "gap" in tables else None,
            interfaces=convert(tables.get("interfaces", {}), Mapping[str, InterfaceSettings], title,
                               "interfaces"),
            path=path, _keys=key_tree(tables),
            content_hashes=content_hashes(of_the_run(tables), folder),
            **{name: from_table(kind, tables.get(name, {}), f"{title}: [{name}]")
               for name, kind in _SECTIONS.items() if name in tables or name not in LAWS},
            **{name: from_table(kind, flat(tables[name]), f"{title}: [{name}]")
               for name, (kind, flat) in _OPTIONAL.items() if name in tables},
        )
        check_bodies(study, title)
        return study

    @property
    def name(self) -> str:
        """Name of the file without its ending."""
        return "study" if self.path is None else self.path.stem

    @property
    def results(self) -> Path:
        """Folder of the results."""
        return self.folder / self.output.folder

    @property
    def t_end(self) -> float:
        """End of the run [s]; InputError if the study does not give it."""
        if self.simulation.t_end is None:
            raise InputError(f"{_title(self.path)}: [simulation] lacks the key 't_end', the end "
                             f"of the run in s.")
        return self.simulation.t_end

    def tables(self, *, defaults: bool = True) -> dict[str, Any]:
        """All sections as tables for TOML.

        With ``defaults`` every key that has a value, else those that the file gives or that differ
        from their defaults.
        """
        every = self._tables(True)
        return every if defaults else with_keys(self._tables(False), every, self._keys)

    def _tables(self, defaults: bool) -> dict[str, Any]:
        """All sections as tables, with or without values equal to their defaults."""
        sections = {name: to_table(getattr(self, name), defaults=defaults)
                    for name in _SECTIONS
                    if getattr(self, name) is not None
                    and not (self.bodies and name in ("body", "basis"))}
        first: dict[str, Any] = {"bodies": {name: one.table(defaults=defaults)
                            for name, one in self.bodies.items()}}
        if self.geometry is not None:
            first = {"geometry": geometry_table(self.geometry, defaults=defaults)}
            sections["body"] = body_table(self.body, self.geometry, defaults=defaults)
        if self.links:
            first["links"] = {name: link_table(one, defaults=defaults)
                              for name, one in self.links.items()}
        full = defaults and bool(self.bodies)
        interfaces = {"interfaces": {name: to_table(one, defaults=full) for name, one in
                                     self.interfaces.items()}} if self.interfaces else {}
        for name in _OPTIONAL:
            if getattr(self, name) is not None:
                sections[name] = to_table(getattr(self, name), defaults=defaults)
        gap = {} if self.gap is None else {"gap": plain(self.gap)}
        return {**gap, **first, **interfaces,
                **{name: table for name, table in sections.items()
                   if table or defaults or name in LAWS}}

    def to_toml(self, *, defaults: bool = True) -> str:
        """The study as TOML text: every key that has a value, or those of :meth:`tables`.

        Comments at the end of the text with every key list the hashes of the files that it names,
        and the keys that the file gives.
        ``Study.from_toml(study.to_toml(), study.path) == study``.
        """
        import tomli_w

        given = self.tables(defaults=False)
        if not defaults:
            return tomli_w.dumps(given)
        keys = json.dumps(key_tree(given), sort_keys=True)
        files = (f"{FILES}{json.dumps(self.content_hashes, sort_keys=True)}\n"
                 if self.content_hashes else "")
        return f"{tomli_w.dumps(self.tables())}\n{files}{KEYS_GIVEN}{keys}\n"

    def with_(self, changes: Mapping[str, Any] | None = None, /, **by_name: Any) -> "Study":
        """Copy of the study with other values, given by dotted keys of the file.

        ``study.with_({"ground.speed": 0.1, "body.fixed.pivot": "xy"})``; list entries are
        numbered, ``load.forces.0.signal.amplitude``. Another ``law`` keeps only the keys that it
        has. Mesh, body and modal basis are reused if nothing they depend on changes.

        Raises
        ------
        InputError
            If a key does not exist (the message suggests the nearest), or a value is of the wrong
            type or out of range.
        """
        changes = merged(changes, by_name)
        tables = self.tables(defaults=False)
        for name, value in changes.items():
            *sections, key = name.split(".")
            if self.bodies and len(sections) > 1 and sections[0] == "interfaces" and (
                    sections[1] not in self.interfaces
                    and f"interfaces.{sections[1]}.face" not in changes):
                raise InputError(f"{self.title}: {name} names the interface '{sections[1]}'"
                                 f"{nearest(sections[1], self.interfaces)}; there are: "
                                 f"{choices(self.interfaces)}.")
            table: Any = tables
            for depth, section in enumerate(sections, 1):
                if isinstance(table, list):
                    table = table[_number(section, table, name, _title(self.path))]
                else:
                    table = table.setdefault(section, {})
                if not isinstance(table, dict | list):
                    raise InputError(f"{_title(self.path)}: {name} cannot be set, because "
                                     f"{'.'.join(sections[:depth])} = {shown(table)} is not a "
                                     f"table.")
            place = _number(key, table, name, _title(self.path)) if isinstance(table, list) else key
            table[place] = plain(value)
            if key == "law" and isinstance(table, dict):
                for old in foreign_keys(table, value):
                    del table[old]
        study = self.from_tables(tables, self.path)
        study.reuse(self)
        return study

    def system(self) -> ContactSystem:
        """The contact system.

        Raises
        ------
        FecontactError
            Error with file and section in front of the message, as for the other methods.
        """
        return contact_system(self, self.reduced, _title(self.path))

    def load_history(self) -> LoadHistory:
        """Load the system along the path of ``[preload]``; see :func:`fecontact.load_history`."""
        title = _title(self.path)
        if self.preload is None:
            raise InputError(f"{title} lacks the section [preload], the path of loads; give values "
                             f"for the vertices of at least one of its keys.")
        system = self.system()
        with located(f"{title}: [preload]:", "LoadPath"):
            return self.preload.load(system)

    def initial(self) -> Initial:
        """Start of a run: ``[simulation]``'s ``initial``, or the end of ``[preload]``."""
        given = self.simulation.initial
        return self.load_history() if given == "preload" else given

    def run(
        self, progress: bool | Callable[[float], None] | None = None,
        checkpoint: Path | None = None, keep_steps: bool | None = None,
    ) -> Trajectory:
        """Run the study from ``t_start`` to ``t_end``; see :func:`fecontact.simulate`.

        Solvers without checkpoints ignore ``checkpoint``. The file is kept after the run: remove
        it once the run is written. ``keep_steps`` takes the place of that of the study.
        """
        self.require_no_sector("`fecontact response` computes its waves")
        settings, t_end = self.simulation, self.t_end
        with self.warning_of_bodies():
            system = self.system()
        solver = settings.chosen_solver()
        if isinstance(solver, CompiledSolver):
            solver = replace(solver, checkpoint=checkpoint, keep_checkpoint=True)
        with located(f"{_title(self.path)}: [output]:"):
            # Check names before the run: an error after a long run would come too late.
            for point in self.output.points:
                system.basis.point_index(point)
        warn_of_limits(implausible_faces(self.made_bodies(), self.contact_faces, system),
                       "In this study")
        initial = self.initial()
        with located(f"{_title(self.path)}: [simulation]:"):
            return simulate(system, t_end, t_start=settings.t_start,
                            initial=initial, outputs=settings.outputs,
                            solver=solver, rtol=settings.rtol, max_step=settings.max_step,
                            progress=progress, keep_steps=(
                                settings.keep_steps if keep_steps is None else keep_steps),
                            events=(ContactEvents(settings.stop)
                                    if settings.events or settings.stop else None))

    @contextmanager
    def warning_of_bodies(self) -> Iterator[None]:
        """Warn of implausible size, materials and thickness of the bodies that are made meanwhile.

        Also before an error, such as one of modes, whose cause they may be.
        """
        try:
            yield
        finally:
            warn_of_limits(implausible_bodies(self.made_bodies()), "In this study")

    def measure(self, run: Trajectory | None = None) -> Measurement:
        """Measure a run of the study, by default a new one, by the sensors of ``[measurement]``.

        See :func:`fecontact.measured.measure`.

        Raises
        ------
        InputError
            Without this section or sensors in it, and as that function.
        """
        title, settings = _title(self.path), self.require_sensors()
        with located(f"{title}: [measurement]:", "measure"):
            return settings.of(self.run() if run is None else run, with_stingers(self.links),
                               title)

    def require_sensors(self) -> MeasurementSettings:
        """Section ``[measurement]``; InputError without it, or without sensors in it."""
        if self.measurement is None or not self.measurement.sensors:
            raise InputError(f"{_title(self.path)} has no sensors; add the section [measurement] "
                             f"with its rate_hz, and [[measurement.sensors]] with point and "
                             f"direction.")
        return self.measurement

    def wear_history(self, progress: bool = False) -> WearHistory:
        """Wear of the contact face over the blocks of ``[wear]``, with ``[simulation]``'s solver.

        See :func:`fecontact.integrate.wear_history`.
        """
        self.require_no_sector("`fecontact response` computes its waves")
        wanted, settings, title = self.wear, self.simulation, _title(self.path)
        if (law := wanted.law_if_any) is None:
            raise InputError(f"{title}: [wear] lacks the key 'coefficient', in m^3/J for law = "
                             f"'energy' and in m^2/N for 'archard'.")
        if (thickness := self.thickness) is None:
            raise InputError(f"{title}: [wear] needs bodies of one thickness; give the same to all "
                             f"in [bodies.NAME.body].")
        system = self.system()
        if system.basis.dimension == 3:
            thickness = None
        with located(f"{title}: [wear]:", "wear_history:"):
            return wear_history(
                system, law, thickness, acceleration=wanted.acceleration,
                blocks=wanted.blocks, periods=wanted.periods, settling=wanted.settling,
                period=wanted.period, initial=self.initial(), outputs=wanted.outputs,
                solver=settings.chosen_solver(), rtol=settings.rtol, progress=progress)


def of_the_run(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of a study without the sections that do not affect the run."""
    return {name: table for name, table in tables.items() if name not in NOT_OF_THE_RUN}


def _number(text: str, items: list[Any], name: str, title: str) -> int:
    number = whole_number(text)
    if number is None or number >= len(items):
        raise InputError(f"{title}: {name} cannot be set, because '{text}' is none of the "
                         f"{len(items)} members, counted from 0.")
    return number


def _title(path: Path | None) -> str:
    return "The study" if path is None else str(path)


def _gap(value: Any, title: str) -> Gap:
    gap: Gap = convert(value, Gap, title, "gap")
    if isinstance(gap, Crown | HeightMap):
        return gap
    numbers = gap if isinstance(gap, tuple) else (gap,)
    if not all(0.0 <= number < float("inf") for number in numbers):
        raise InputError(f"{title}: gap = {shown(value)} must be finite and zero or above.")
    return gap


def stored_study(
    text: str | None, trust: bool | Iterable[Path] = False, path: Path | None = None
) -> Study:
    """Study in a file of results, from its TOML text; ``path`` is the study file it stands for.

    Code of laws that the text names is executed only as far as ``trust`` allows, see
    :func:`~fecontact.laws.own_files.trusting`.
    """
    with trusting(trust):
        return Study.from_toml(text or "", path)


def with_given_keys(text: str | None) -> str | None:
    """Study as TOML text with the keys that its file gives, if that runs no code of its author.

    Text that names laws that are not loaded, or that this version cannot read, is returned
    unchanged.
    """
    if text is None:
        return text
    try:
        return stored_study(text).to_toml(defaults=False)
    except FecontactError:
        return text
