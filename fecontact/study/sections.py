"""Sections of a study file that are not described by a class of another module."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

from fecontact.core.checks import whole_number
from fecontact.core.errors import (
    InputError,
    choices,
    require_not_negative,
    require_positive,
)
from fecontact.core.tables import convert_fields, located, plain, shown
from fecontact.core.types import Coordinates
from fecontact.core.units import Unit
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elements.quadrature import Integration
from fecontact.fem.material import AnyMaterial, Material
from fecontact.fem.mesh import Bricks, Mesh
from fecontact.fem.points import Patch
from fecontact.fem.rotation import Rotation
from fecontact.integrate.initial_state import PointStart, RigidStart
from fecontact.integrate.solvers import SOLVERS, Solver, solver_by_name
from fecontact.laws.base import PerNode
from fecontact.laws.excitation import Load
from fecontact.laws.wear import ArchardWear, EnergyWear, WearLaw
from fecontact.reduction.damping import LossFactor, Rayleigh
from fecontact.reduction.half_space_compliance import with_half_space
from fecontact.reduction.large_deflections.options import LargeDeflections
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.reduce_body import modal_basis
from fecontact.study.materials_section import MaterialSettings
from fecontact.system.statics.static_solution import static_solution

_MATERIAL_KEYS = ("material", "youngs_modulus", "poisson_ratio", "density")
Place = str | Coordinates | Patch


@dataclass(frozen=True)
class BodySettings:
    """``[body]``: material, thickness and supports; see
    :class:`fecontact.ElasticBody`.

    Parameters
    ----------
    material : str, optional
        'steel' or 'aluminium'; the keys below override single values. Without any of these keys the
        body has the materials of its mesh file, or else is of steel.
    youngs_modulus, poisson_ratio, density : float, optional
        Young's modulus [Pa], Poisson's ratio, density [kg/m^3]; all three are required without
        ``material``.
    materials : list of tables
        ``[[body.materials]]``, instead of the keys above: materials of groups of cells, or an
        anisotropic material of the whole body.
    thickness : float
        Out-of-plane thickness of a plane body [m]; required in plane stress, 1 m by default in
        plane strain. An error for a solid.
    plane : 'stress' or 'strain'
        Plane stress for thin bodies, plane strain for long bodies. An error for a solid.
    degree : 1 or 2
        Polynomial degree of the finite elements.
    bricks : 'full', 'incompatible' or 'serendipity', optional
        Kind of the elements, by default as in the mesh file. Hexahedra with ``degree = 1`` may have
        incompatible modes. With ``degree = 2``, serendipity elements have 8, 20, 15 or 13 nodes,
        others nodes in the middles of faces and cells too.
    integration : 'exact', 'full' or 'reduced', optional
        Points of quadrature of the stiffness, by default as in the mesh file: enough for straight
        cells, or those of the elements of Abaqus, CalculiX and Ansys. Reduced elements with
        ``degree = 1`` have a mean strain and hourglass stiffness.
    hourglass : float
        Stiffness of hourglasses over the shear modulus: 0.005 in Abaqus, 0.001 (1 + nu) in CalculiX
        with Poisson's ratio nu.
    fixed : mapping of name to 'x', 'y', 'xy', of solids also 'z', 'xz', 'yz', 'xyz', or 'hinge'
        Supports on boundaries and points of the mesh: held directions, or 'hinge' for a hole that
        turns about its centre. In a solid 'hinge_x', 'hinge_y', 'hinge_z' give the axis. At
        reference points of couplings also 'clamped', or components such as 'x y phi_z'.
    rotation : Rotation, optional
        ``[body.rotation]``: rotation at constant speed, of a solid about an axis, of a plane body
        about a point.
    """

    material: str | None = None
    youngs_modulus: float | None = None
    poisson_ratio: float | None = None
    density: float | None = None
    materials: tuple[MaterialSettings, ...] = ()
    thickness: Annotated[float | None, Unit("m")] = None
    plane: Literal["stress", "strain"] = "stress"
    degree: Literal[1, 2] = 2
    bricks: Bricks | None = None
    integration: Integration | None = None
    hourglass: float = 0.005
    fixed: Mapping[str, str] = field(default_factory=dict)
    rotation: Rotation | None = None

    def __post_init__(self) -> None:
        convert_fields(self)
        require_positive("BodySettings", hourglass=self.hourglass)
        if self.thickness is not None:
            require_positive("BodySettings", thickness=self.thickness)
        with located("BodySettings:", "Material"):
            _ = self.elastic_material
        self._check_materials()

    def _check_materials(self) -> None:
        """Refuse materials beside a single one, and several without or with the same cells."""
        given = [key for key in _MATERIAL_KEYS if getattr(self, key) is not None]
        if self.materials and given:
            raise InputError(f"BodySettings: {choices(given)} and materials both describe the "
                             f"material; give one of them.")
        cells = [one.cells for one in self.materials]
        if len(cells) > 1 and None in cells:
            raise InputError(f"BodySettings: materials has {len(cells)} materials, one of them "
                             f"without cells; name the group of cells of each.")
        if twice := {name for name in cells if cells.count(name) > 1}:
            raise InputError(f"BodySettings: materials names the cells {choices(map(str, twice))} "
                             f"twice; give each group one material.")

    @property
    def depth(self) -> float:
        """Thickness, or 1 m where it is left out [m]."""
        return 1.0 if self.thickness is None else self.thickness

    @property
    def elastic_material(self) -> AnyMaterial | dict[str, AnyMaterial]:
        """Material described by the four material keys, or those of groups of cells."""
        if self.materials:
            made = {one.cells: one.made for one in self.materials}
            return made[None] if None in made else {f"{name}": one for name, one in made.items()}
        values = {"youngs_modulus": self.youngs_modulus, "poisson_ratio": self.poisson_ratio,
                  "density": self.density}
        given: dict[str, Any] = {key: value for key, value in values.items() if value is not None}
        if self.material is None and given and len(given) < len(values):
            raise InputError(f"BodySettings: {choices(given)} alone does not describe a material; "
                             f"give {choices(values.keys() - given.keys())} too, or a material.")
        return replace(Material.named(self.material or "steel"), **given)

    def elastic_body(self, mesh: Mesh) -> ElasticBody:
        """Elastic body on a mesh.

        Raises
        ------
        InputError, MeshError
            For keys of plane bodies with a solid mesh, and as :class:`fecontact.ElasticBody`.
        """
        if mesh.dimension == 3:
            usual = BodySettings()
            for key in ("thickness", "plane"):
                if (value := getattr(self, key)) != getattr(usual, key):
                    raise InputError(f"ElasticBody: {key} = {shown(plain(value))} is for plane "
                                     f"bodies, but the mesh is that of a solid; leave it out.")
        elif self.thickness is None and self.plane == "stress":
            raise InputError("ElasticBody: the key 'thickness' is missing, the thickness of a "
                             "plane body in m; give it, or plane = \"strain\" for a slice of a "
                             "long part, 1 m thick.")
        of_mesh = mesh.materials and not self.materials and all(
            getattr(self, key) is None for key in _MATERIAL_KEYS)
        return ElasticBody(mesh, None if of_mesh else self.elastic_material, thickness=self.depth,
                           plane=self.plane, degree=self.degree, fixed=self.fixed,
                           bricks=self.bricks, integration=self.integration,
                           hourglass=self.hourglass)


@dataclass(frozen=True)
class BasisSettings:
    """``[basis]``: modes and points; see
    :func:`fecontact.modal_basis`.

    Parameters
    ----------
    modes : int
        Number of modes, the rigid ones included.
    contact : str or list of str
        Boundary in contact with the ground, or several; each becomes an interface of its name.
        Faces of solids on the ground must face -z. With ``contact = []`` the system is linear and
        needs no laws.
    contact_nodes : int or 'all', of solids also two integers, or list
        Number of contact nodes, or 'all' for every mesh node of the boundary; a list has one entry
        for each boundary. Contact nodes of a solid are patches of about equal area: their number,
        'all' for one patch per facet, or ``[n, m]`` along the first and second tangent (x and y on
        the ground; around and across a ring).
    B, C : place, optional
        Drive point B and load point C: name of a point or boundary, [x, y] ([x, y, z] of solids),
        or a patch ``{at = name or place, radius = r}``.
    points : mapping of name to place
        Further points to observe.
    damping : float, list, Rayleigh, LossFactor or 'materials'
        One damping ratio, one ratio per mode, ``{mass_factor, stiffness_factor}`` (Rayleigh),
        ``{loss_factor}``, or 'materials' for the loss factors of the body's materials.
    reduction : 'vibration', 'residual' or 'craig-bampton'
        'vibration': free vibration modes; 'residual': these with residual vectors; 'craig-bampton':
        Craig-Bampton modes (with constraint modes).
    tolerance : float
        For 'residual': largest fraction of the static compliance at the points, and of the response
        to the loads, that may be neglected.
    loads : list of places
        Loads whose static response is added to the modes, for 'residual' and 'craig-bampton':
        'gravity' (and base acceleration), boundaries (pressure and shear), points (forces).
    dashpots : mapping of point to [b_x, b_y], of solids [b_x, b_y, b_z]
        Viscous dampers to the inertial frame [N s/m], at points or at contact nodes by number.
    select : list, optional
        Indices of the modes to keep, counted from 0; all by default.
    eigensolver : 'auto', 'direct' or 'iterative'
        Solver for the modes of solids; 'auto' takes the iterative one for large, compact bodies.
    prestress : bool
        True: modes about the static state under ``[load]``, whose stress stiffens the body. The
        supports must hold the body.
    temperature : float or 'mesh', optional
        Change of temperature of the whole body from the state without stress [K], a constant load,
        or 'mesh' for the temperatures in the deck of the mesh. Needs 'residual' or 'craig-bampton'.
    large_deflections : LargeDeflections, optional
        ``[basis.large_deflections]``: forces of large deflections of some modes.
    half_space : bool
        True: adds the local compliance of a half-space at the contact nodes of a solid, where
        elements and modes are too stiff; see :func:`fecontact.reduction.with_half_space`.
    """

    modes: int = 20
    contact: str | tuple[str, ...] = "contact"
    contact_nodes: int | Literal["all"] | tuple[
        int | Literal["all"] | tuple[int, int], ...] = "all"
    B: Place | None = None
    C: Place | None = None
    points: Mapping[str, Place] = field(default_factory=dict)
    damping: float | tuple[float, ...] | Rayleigh | LossFactor | Literal["materials"] = 0.0
    reduction: Literal["vibration", "residual", "craig-bampton"] = "vibration"
    tolerance: float = 0.1
    loads: tuple[Place, ...] = ()
    dashpots: Annotated[Mapping[str, Coordinates], Unit("N s/m")] = field(
        default_factory=dict)
    select: tuple[int, ...] | None = None
    eigensolver: Literal["auto", "direct", "iterative"] = "auto"
    prestress: bool = False
    temperature: Annotated[float | Literal["mesh"] | None, Unit("K")] = None
    large_deflections: LargeDeflections | None = None
    half_space: bool = False

    def __post_init__(self) -> None:
        convert_fields(self)
        if self.modes < 1:
            raise InputError(f"BasisSettings: modes = {self.modes} must be at least 1.")
        given = self.contact_nodes
        counts = [count for one in (given if isinstance(given, tuple) else (given,))
                  for count in (one if isinstance(one, tuple) else (one,))]
        if any(count != "all" and count < 1 for count in counts):
            raise InputError(f"BasisSettings: contact_nodes = {self.contact_nodes} must be at "
                             f"least 1, or \"all\".")
        if self.prestress and self.large_deflections is not None:
            raise InputError("BasisSettings: prestress = true and large_deflections do not go "
                             "together, as the load would stress the body twice; leave prestress "
                             "out: the deflection under the load stresses the body.")
        for name in self.points:
            if name.isdecimal():
                raise InputError(f"BasisSettings: points has the name '{name}', but contact nodes "
                                 f"go by number; choose a name with a letter.")

    @property
    def options(self) -> dict[str, Any]:
        """Options of :func:`fecontact.modal_basis` that concern neither contact nor modes."""
        names = ("B", "C", "points", "reduction", "tolerance", "damping", "loads", "eigensolver",
                 "temperature", "large_deflections")
        return {name: getattr(self, name) for name in names}

    def modal_basis(
        self, body: ElasticBody, rotation: Rotation | None = None, load: Load | None = None
    ) -> ModalBasis:
        """The modal basis of a body, with ``prestress`` about its state under a load."""
        state = None
        if self.prestress and load is not None:
            with located("prestress = true:"):
                state = static_solution(body, load, points=self.load_points)
        found = modal_basis(
            body, self.modes, contact=self.contact, contact_nodes=self.contact_nodes,
            rotation=rotation, prestress=state, **self.options)
        return self.finished(with_half_space(found, body) if self.half_space else found)

    @property
    def load_points(self) -> dict[str, Place]:
        """Points of the section at which loads may act, by name."""
        ends = {name: place for name, place in (("B", self.B), ("C", self.C)) if place}
        return {**self.points, **ends}

    def finished(self, basis: ModalBasis) -> ModalBasis:
        """A basis with the dashpots of these settings and the modes that they select."""
        if self.dashpots:
            basis = basis.with_dashpots({
                point if (number := whole_number(point)) is None else number: values
                for point, values in self.dashpots.items()})
        return basis if self.select is None else basis.select(self.select)


@dataclass(frozen=True)
class SimulationSettings:
    """``[simulation]``: the run; see :func:`fecontact.simulate`.

    Parameters
    ----------
    t_end : float, optional
        End of the run [s]; required only to run the study.
    t_start : float
        Start of the run [s].
    outputs : int
        Number of equally spaced output times, both ends included.
    solver : str
        'auto', the fastest of 'rodas5p', 'radau' and 'power-series'; 'set-valued' friction,
        'event-driven' or by 'time-stepping'; 'scipy-radau', 'scipy-bdf', 'scipy-lsoda'; 'cvode' of
        scikit-sundae.
    rtol : float
        Relative tolerance.
    max_step : float, optional
        Longest step [s]; by default limited only by the tolerance and by the periods and
        breakpoints of the excitation.
    restitution : float, tuple of float or mapping, optional
        For 'set-valued': rigid stops with this coefficient in place of the normal law; one for all
        contact nodes, one for each, or by interfaces.
    impact_law : str, optional
        For 'set-valued': 'newton', restitution of velocities, or 'poisson', of impulses.
    tangential_restitution : float, tuple of float or mapping, optional
        For 'set-valued': coefficient along the ground of contacts that stick in an impact; given as
        ``restitution``.
    static_coefficient : float, tuple of float or mapping, optional
        For 'set-valued': limit of R/F in stick [-], given as ``restitution``; default that of the
        law.
    keep_steps : bool
        Keep the motion between the outputs for plots, at most 16 MB.
    events : bool
        Locate touch-down, lift-off, stick and slip of every contact node and store them with the
        run.
    stop : list of str
        Events that end the run when they first occur: 'touch-down', 'lift-off', 'stick', 'slip'.
    initial : 'rest', 'sliding', 'preload', RigidStart or PointStart
        Initial state; 'preload' for the end of the path of loads of ``[preload]``;
        ``{displacement = [x, y, phi], velocity = [x, y, phi]}`` for a rigid-body motion, of solids
        ``[x, y, z, phi_x, phi_y, phi_z]``; ``{displacements = {B = {y = 1e-3}}, velocities =
        {B = [0.1, 0.0]}}`` for motions of points, of all with these values the one of least mass.
    """

    t_end: Annotated[float | None, Unit("s")] = None
    t_start: Annotated[float, Unit("s")] = 0.0
    outputs: int = 1001
    solver: str = "auto"
    rtol: float = 1e-6
    max_step: Annotated[float | None, Unit("s")] = None
    restitution: PerNode | dict[str, PerNode] | None = None
    impact_law: str | None = None
    tangential_restitution: PerNode | dict[str, PerNode] | None = None
    static_coefficient: PerNode | dict[str, PerNode] | None = None
    keep_steps: bool = True
    events: bool = False
    stop: tuple[str, ...] = ()
    initial: Literal["rest", "sliding", "preload"] | RigidStart | PointStart = "rest"

    def __post_init__(self) -> None:
        convert_fields(self)
        if not math.isfinite(self.t_start):
            raise InputError(f"SimulationSettings: t_start = {self.t_start!r} must be finite.")
        if self.t_end is not None and not self.t_start < self.t_end < math.inf:
            raise InputError(f"SimulationSettings: t_end = {self.t_end!r} must be a finite time "
                             f"after t_start = {self.t_start!r}.")
        if self.outputs < 2:
            raise InputError(f"SimulationSettings: outputs = {self.outputs} must be at least 2.")
        require_positive("SimulationSettings", rtol=self.rtol)
        if isinstance(self.initial, PointStart):
            self.initial.require_writable("SimulationSettings: initial")
        if self.max_step is not None:
            require_positive("SimulationSettings", max_step=self.max_step)
        with located("SimulationSettings:", "SetValued", "EventDriven", "TimeStepping"):
            solver = self.chosen_solver()
        if (self.events or self.stop) and "events" not in solver.abilities:
            able = [name for name, one in SOLVERS.items() if "events" in one.abilities]
            raise InputError(f"SimulationSettings: events and stop are for solver = "
                             f"{choices(able)}, not '{self.solver}'; leave them out.")

    def chosen_solver(self) -> Solver:
        """The solver object with its options."""
        return solver_by_name(self.solver, {
            "restitution": self.restitution, "impact_law": self.impact_law,
            "tangential_restitution": self.tangential_restitution,
            "static_coefficient": self.static_coefficient})


@dataclass(frozen=True)
class WearSettings:
    """``[wear]``: wear of the contact face; see
    :func:`fecontact.integrate.wear_history`.

    Parameters
    ----------
    law : 'energy' or 'archard'
        Volume proportional to the energy lost in slip, or to normal force times slip distance.
    coefficient : float, optional
        For 'energy' volume per energy [m^3/J], for 'archard' volume per force and distance
        [m^2/N]; required to compute wear.
    acceleration : float
        Cycles that each computed period stands for.
    blocks : int
        Number of blocks; after each the worn depth is added to the gap.
    periods : int
        Computed periods in each block.
    settling : int
        Computed periods before the first block, which wear nothing.
    period : float, optional
        Duration of a cycle [s]; by default the common period of drive, loads and ground.
    outputs : int
        Output times of each block.
    """

    law: Literal["energy", "archard"] = "energy"
    coefficient: float | None = None
    acceleration: float = 1.0
    blocks: int = 10
    periods: int = 1
    settling: int = 0
    period: Annotated[float | None, Unit("s")] = None
    outputs: int = 401

    def __post_init__(self) -> None:
        convert_fields(self)
        require_positive("WearSettings", acceleration=self.acceleration)
        for name, least in (("blocks", 1), ("periods", 1), ("settling", 0), ("outputs", 2)):
            if (count := getattr(self, name)) < least:
                raise InputError(f"WearSettings: {name} = {count} must be at least {least}.")
        if self.period is not None:
            require_positive("WearSettings", period=self.period)
        if self.coefficient is not None:
            require_not_negative("WearSettings", coefficient=self.coefficient)

    @property
    def law_if_any(self) -> WearLaw | None:
        """The wear law; None without a coefficient."""
        if self.coefficient is None:
            return None
        return {"energy": EnergyWear, "archard": ArchardWear}[self.law](self.coefficient)


@dataclass(frozen=True)
class OutputSettings:
    """``[output]``: files written by a run.

    Parameters
    ----------
    folder : str
        Folder of the results, relative to the study file.
    frames : int
        Number of displacement fields stored for ParaView; zero for none.
    points : list
        Points whose motion is plotted: 'B', 'C', other named points, or contact nodes by number.
        B and C if empty.
    """

    folder: str = "results"
    frames: int = 200
    points: tuple[str | int, ...] = ()

    def __post_init__(self) -> None:
        convert_fields(self)
        if self.frames < 0:
            raise InputError(f"OutputSettings: frames = {self.frames} must be zero or above.")
