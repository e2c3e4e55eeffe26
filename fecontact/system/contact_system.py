"""The contact system: a modal basis, laws at its contact nodes, drive and load."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import InitVar, dataclass, field, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import merged
from fecontact.core.dotted_parameters import parameters_of, with_parameters
from fecontact.core.errors import InputError, choices, nearest, require_finite
from fecontact.core.read_only import read_only
from fecontact.core.types import Array
from fecontact.core.units import Summarised, listed, quantity
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.check import require_sound
from fecontact.laws.excitation import Drive, Load
from fecontact.laws.friction.stribeck import ConstantFriction
from fecontact.laws.friction_contact import separated
from fecontact.laws.ground.ground import Ground
from fecontact.laws.normal.linear import PrescribedForce
from fecontact.reduction.assembly.contact_faces import several_bodies
from fecontact.reduction.assembly.links import Links
from fecontact.reduction.basis_parameters import basis_parameter, with_basis_parameters
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system import jacobian as contact_jacobian
from fecontact.system import kernels
from fecontact.system.arrays import (
    LawGroup,
    excited,
    groups_of_laws,
    require_laws,
    system_arrays,
)
from fecontact.system.contact_quantities import Instant
from fecontact.system.elastic_sliders import exact_arrays, slider_counts
from fecontact.system.friction_memory import bristle_history, memory_scales, velocity_scale
from fecontact.system.gap import Gap, gap_values
from fecontact.system.interfaces import (
    Interface,
    PrescribedMotion,
    Sliding,
    checked_sliding,
    inner_name,
    motion_sources,
    names_of_laws,
    outer_name,
    prescribed_motion,
    slides,
    sliding_speed,
    system_fields,
)
from fecontact.system.loads import force_scale, load_summary, require_motion
from fecontact.system.nodes import SystemArrays

NO_NORMAL_LAW = ("{}, the law of the normal force, which has no default; give a rough "
                 "surface with its stiffness and roughness_height, or another law: `fecontact "
                 "laws` lists them, `fecontact laws rough-surface` says how to choose.")

NO_FRICTION_LAW = ("{}, although contact nodes can move along the ground: give a friction law with "
                   "its coefficients, such as the exponential or the constant one, or law = "
                   "\"frictionless\" (Frictionless() in Python); `fecontact laws` lists them.")

PARTS = ("normal", "friction", "sliding", "ground", "drive", "load")
# Laws of a system without contact nodes, which act nowhere: its equations are linear.
NO_LAWS: Mapping[str, NormalLaw | FrictionLaw] = MappingProxyType(
    {"normal": PrescribedForce(0.0), "friction": ConstantFriction(0.0)})
IN_SPACE_ONLY = frozenset({"ground.speed_y", "ground.rotation_speed", "ground.centre",
                           "ground.wave_direction", "drive.stiffness_z",
                           "drive.damping_z", "drive.amplitude_z"})

_KINDS = {"basis": ModalBasis, "ground": Ground, "drive": Drive, "load": Load}


def needs_friction(basis: ModalBasis) -> bool:
    """Whether a contact node can move along the ground, so that friction matters."""
    return bool(slides(basis).any())


@dataclass(frozen=True, eq=False, repr=False)
class ContactSystem(Summarised):
    """Reduced equations of elastic bodies in contact with moving ground or each other.

    One body on the ground, (4.1-1) to (4.1-23): ``ContactSystem(basis, normal=, friction=, ...)``;
    several: ``ContactSystem(bodies=, interfaces=, links=, ...)``.

    ``q'' + D q' + w^2 q = T^T f``, where f are the forces of the drive's springs and dashpots at B,
    the loads at C and other points, and ``[-R_j, F_j, 0]`` at contact node j from the normal and
    the friction law. Immutable; see :meth:`with_`.

    Attributes
    ----------
    basis : ModalBasis
    normal : normal law, or mapping of interface to normal law
        Normal force F (on the body, upwards) from penetration and its rate. Required if there are
        contact nodes; a system without contact nodes is linear and has no laws. A
        :class:`~fecontact.laws.FrictionContact3D` is stored as both laws.
    friction : friction law, or mapping of interface to friction law
        Friction force R (on the body, against the slip velocity). Required if a contact node can
        move along the ground.
    ground : Ground
        Profile and motion of the ground.
    drive : Drive
        Base excitation of B.
    load : Load
        Loads at C and other points.
    gap : float, (n,) sequence, Crown, HeightMap or function of x
        Initial distance g_j of the contact nodes from flat ground, zero or above [m]; stored as
        numbers. By default that of the mesh, whose lowest contact node touches the ground; with
        interfaces that of their faces.
    sliding : mapping of interface to SlidingTranslation or SlidingRotation
        Prescribed motion of the other sides of interfaces.
    bodies : mapping of name to ModalBasis, optional
        Several bodies, assembled to ``basis``.
    interfaces : sequence of Interface, optional
        Contacts of the bodies, with their laws; these become ``normal``, ``friction``, ``gap`` and
        ``sliding``.
    links : sequence, or mapping of name to link, optional
        Welds, hinges, bushings and springs between the bodies. Parameters of nonlinear springs are
        ``links.NAME.stiffness``.

    Raises
    ------
    InputError
        Without a required normal or friction law; for laws without contact nodes, a part of wrong
        type, laws for unknown interfaces, parameters or gaps that do not match the number of
        contact nodes, speeds that cannot be combined (:attr:`prescribed_motion`), laws that
        :func:`require_sound` refuses, and drives or loads in a direction in which no mode moves
        their point.
    """

    # Basis, and normal of contact nodes, are required: the message is better than Python's own.
    basis: ModalBasis = None  # type: ignore[assignment]
    normal: NormalLaw | Mapping[str, NormalLaw] = None  # type: ignore[assignment]
    friction: FrictionLaw | Mapping[str, FrictionLaw] = None  # type: ignore[assignment]
    ground: Ground = field(default_factory=Ground)
    drive: Drive = field(default_factory=Drive)
    load: Load = field(default_factory=Load)
    gap: Gap | None = None
    sliding: Mapping[str, Sliding] = field(default_factory=dict)
    bodies: InitVar[Mapping[str, ModalBasis] | None] = None
    interfaces: InitVar[Sequence[Interface] | None] = None
    links: InitVar[Links | None] = None

    def __post_init__(
        self, bodies: Mapping[str, ModalBasis] | None, interfaces: Sequence[Interface] | None,
        links: Links | None,
    ) -> None:
        if bodies is not None or interfaces is not None or links is not None:
            if any(getattr(self, name) is not None for name in ("basis", "normal", "friction")):
                raise InputError("ContactSystem: give either basis with normal and friction, or "
                                 "bodies with interfaces, which hold their laws.")
            for name, value in system_fields(bodies, interfaces, links).items():
                object.__setattr__(self, name, value)
        self._check()

    def __reduce__(self) -> tuple[Any, ...]:
        # Without what is made of them: addresses of compiled laws differ between processes.
        given = (getattr(self, one.name) for one in fields(self))
        return type(self), tuple(dict(one) if isinstance(one, Mapping) else one for one in given)

    def _check(self) -> None:
        """Check all parts and bring them into their stored form."""
        if isinstance(self.basis, ModalBasis) and not self.basis.contact_nodes:
            self._without_contact()
        for name, laws in zip(NO_LAWS, separated(self.normal, self.friction, "ContactSystem"),
                              strict=True):
            object.__setattr__(self, name, laws)
        if self.normal is None:
            raise InputError(NO_NORMAL_LAW.format("ContactSystem lacks normal"))
        if self.friction is None:
            if isinstance(self.basis, ModalBasis) and needs_friction(self.basis):
                raise InputError(NO_FRICTION_LAW.format("ContactSystem lacks friction"))
            object.__setattr__(self, "friction", ConstantFriction(0.0))
        self._require_parts(_KINDS)
        names = [group for group, _ in self.basis.groups]
        for name, law in (("normal", NormalLaw), ("friction", FrictionLaw)):
            given = getattr(self, name)
            require_laws("ContactSystem", name, law, given, "interface", names)
            if isinstance(given, Mapping):
                object.__setattr__(self, name, MappingProxyType(dict(given)))
        # Faces of interfaces have gaps of their own, see system_fields.
        gap = 0.0 if self.gap is None and several_bodies(self.basis) else self.gap
        object.__setattr__(self, "gap", gap_values(gap, self.basis.contact_places))
        object.__setattr__(self, "sliding", checked_sliding(self.basis, self.ground, self.sliding))
        _ = self.prescribed_motion
        for part in (self.law_groups("normal"), self.law_groups("friction")):
            for _, share, one in part:
                one.table(share)
                require_sound(one)
        require_motion(self.basis, self.drive, self.load)
        _ = self.arrays

    def _without_contact(self) -> None:
        """Give a system without contact nodes the laws :data:`NO_LAWS`; refuse other ones."""
        for name, law in NO_LAWS.items():
            given = getattr(self, name)
            if given and given != law:
                raise InputError(f"ContactSystem: {name} = {given!r} is a law of contact nodes, "
                                 f"but there are no contact nodes; give the basis contact nodes "
                                 f"or the bodies an interface, or leave out the law for a linear "
                                 f"system.")
            object.__setattr__(self, name, law)

    def _require_parts(self, names: Iterable[str]) -> None:
        for name in names:
            given, kind = getattr(self, name), _KINDS[name]
            if not isinstance(given, kind):
                raise InputError(f"ContactSystem: {name} = {given!r} must be a {kind.__name__}.")
        if self.basis.dimension == 2:
            for what, needs in (("Ground", self.ground.in_space), ("Drive", self.drive.in_space)):
                if needs:
                    raise InputError(
                        f"ContactSystem: the {what.lower()} acts or moves along a third direction, "
                        f"but the body is plane; leave that out, or make a solid.")

    def _excited(self, parts: Mapping[str, Any]) -> "ContactSystem":
        """A copy with another drive or load; all else has been checked, and keeps its arrays."""
        made = object.__new__(type(self))
        made.__dict__.update(self.__dict__, **parts)
        made.__dict__.pop("_fields", None)  # Fields of parameters that it keeps.
        made._require_parts(parts)
        made.__dict__["arrays"] = self.arrays_with(parts)
        return made

    def arrays_with(self, parts: Mapping[str, Any]) -> SystemArrays:
        """Arrays with another 'drive' or 'load' in ``parts``, which is checked as by with_()."""
        require_motion(self.basis, parts.get("drive", self.drive), parts.get("load", self.load))
        return excited(self.arrays, self.basis, self.drive, parts)

    def summary(self) -> list[tuple[str, str]]:
        """Modes and contact nodes, laws, ground, drive and load."""
        own = dict(self.basis.summary())
        drive, ground = self.drive, self.ground
        low, high = ground.height_range
        stiffness = [f"{quantity(value, 'N/m')} in {axis}"
                     for axis, value in zip("xyz", drive.stiffness, strict=True) if value]
        moves = any(motion.largest > 0.0 for motion in drive.motions)
        moved = drive.fundamental_hz if moves else 0.0
        return [
            *((name, own[name]) for name in ("bodies", "modes", "frequencies", "contact nodes")
              if name in own),
            *((kind, names) for kind in NO_LAWS if self.basis.contact_nodes and (
                names := names_of_laws(
                    getattr(self, kind), self.basis.springs if kind == "friction" else ()))),
            *([("sliding", listed([f"{name} {sliding_speed(one)}" for name, one
                                   in self.sliding.items()]))] if self.sliding else []),
            ("ground", quantity(ground.speed, "m/s")
             + (f", {quantity(high - low, 'm')} from valley to peak" if ground.wavy else "")),
            ("drive", listed(stiffness) + (f", {moved:.5g} Hz" if moved else "")),
            ("load", load_summary(self.load)),
        ]

    def law_groups(self, kind: Literal["normal", "friction"]) -> Sequence[LawGroup]:
        """Groups of contact nodes with a common law: slice, share of each node, law.

        Extensive parameters are totals of the whole face for a single law, and totals of the group
        for the law of an interface.
        """
        return self._law_groups[kind]

    @cached_property
    def _law_groups(self) -> dict[str, Sequence[LawGroup]]:
        found: dict[str, Sequence[LawGroup]] = {}
        for kind in NO_LAWS:
            given, basis = getattr(self, kind), self.basis
            groups = [(count, given[name]) for name, count in basis.groups] if isinstance(
                given, Mapping) else [(basis.contact_nodes, given)]
            found[kind] = read_only(tuple(groups_of_laws(
                [one for one in groups if one[0] or len(groups) == 1], basis.tributary)))
        return found

    def require_compliance(self, what: str) -> None:
        """Raise InputError if some contacts are rigid stops, of which something needs a force."""
        if any(law.rigid for _, _, law in self.law_groups("normal")):
            raise InputError(f"{what}: a RigidStop has no force of the penetration; give contacts "
                             f"a normal law with stiffness, or run the system by simulate(..., "
                             f"initial=..., solver=SetValued(restitution=...)).")

    @property
    def share(self) -> Array:
        """Fraction (n,) of the contact face of each node; their sum is one."""
        return self.basis.tributary / self.basis.tributary.sum()

    @cached_property
    def prescribed_motion(self) -> PrescribedMotion:
        """Motion of ground and other sides: a function of time and a factor for each node."""
        return prescribed_motion(self.basis, self.ground, self.sliding)

    @property
    def memory(self) -> int:
        """Number s of internal variables that the state holds for each contact node."""
        return int(self.arrays.memory.max())

    @property
    def size(self) -> int:
        """Number of values of a state y = [q, q', z]: 2 m + n s."""
        return 2 * self.basis.modes + self.basis.contact_nodes * self.memory

    @property
    def penetration_scale(self) -> float:
        """Smallest characteristic penetration of the normal laws [m]."""
        return min(law.penetration_scale for _, _, law in self.law_groups("normal"))

    @cached_property
    def force_scale(self) -> float:
        """Scale of the forces for tolerances, 1 N at most [N]."""
        return force_scale(self.basis, self.drive, self.load, self.law_groups("normal"))

    @property
    def velocity_scale(self) -> float:
        """Smallest slip velocity over which a friction force rises [m/s]."""
        return min(velocity_scale(law, self.force_scale) for *_, law in self.law_groups("friction"))

    @property
    def memory_scales(self) -> Array:
        """Scale (n s,) of each internal variable of the state."""
        return memory_scales(self.basis, self.memory, self.law_groups("friction"), self.force_scale)

    def breakpoints(self, start: float, end: float) -> tuple[float, ...]:
        """Times between two [s] at which drive, loads or ground motion have kinks, ascending."""
        given: tuple[Any, ...] = (
            *self.drive.motions, *self.load.signals.values(), *self._motions)
        return tuple(sorted({time for source in given
                             for time in source.breakpoints(start, end)}))

    def shortest_period(self, start: float, end: float) -> float:
        """Shortest period of drive, loads, belt and waves under the body [s]; infinite if none.

        Waves pass at the largest speed of the ground between the two times [s].
        """
        given: list[Any] = [motion for motion in self.drive.motions if motion.largest > 0.0]
        given += self.load.signals.values()
        given += self._motions
        periods = [source.shortest_period for source in given]
        wavelength, speed = self.ground.shortest_wavelength, self.ground.largest_speed(start, end)
        if wavelength is not None and speed > 0.0:
            periods.append(wavelength / speed)
        return float(min((period for period in periods if period is not None), default=np.inf))

    @cached_property
    def _motions(self) -> tuple[Any, ...]:
        """Motions in time of ground and sliding interfaces."""
        return tuple(source.motion
                     for source in motion_sources(self.basis, self.ground, self.sliding)
                     if source.motion is not None)

    def stored_energy(self, penetration: Array) -> Array:
        """Energy (...,) stored in the contact [J] at penetrations (..., n) [m]."""
        energy = np.zeros(penetration.shape[:-1])
        for nodes, share, law in self.law_groups("normal"):
            energy += law.stored_energy(penetration[..., nodes], share).sum(axis=-1)
        return energy

    def sticks(
        self, slip_velocity: Array, normal_force: Array, friction_force: Array
    ) -> NDArray[np.bool_]:
        """Whether nodes in contact stick, from their slip velocities, F and R, each (N, n)."""
        return np.concatenate(
            [law.sticks(slip_velocity[..., nodes], np.abs(normal_force[..., nodes]),
                        friction_force[..., nodes])
             for nodes, _, law in self.law_groups("friction")], axis=-1)

    @cached_property
    def arrays(self) -> SystemArrays:
        """The system as arrays for the compiled kernels, not to be written to.

        They stay writeable: kernels take read-only arrays by a conversion at each call.
        """
        return system_arrays(
            self.basis, self.law_groups("normal"), self.law_groups("friction"), self.ground,
            self.drive, self.load, np.asarray(self.gap, dtype=float), self.prescribed_motion)

    def rhs(self, t: float, y: Array) -> Array:
        """Rate y' (2 m + n s,) of the state y = [q, q', z].

        Deflections z of elastic Coulomb elements (Jenkins, Iwan) follow the slip velocity, also
        beyond their limits; their forces are k z, at most mu F. What z exceeds its limit by is the
        distance that the element has slid. :func:`fecontact.simulate` returns z to the limit where
        slip ends; an integrator of your own has to do so after each step.
        """
        out = np.empty(self.size)
        arrays = exact_arrays(self.arrays, slider_counts(self))
        kernels.right_hand_side(float(t), self._checked(y), arrays, out)
        return out

    def jacobian(self, t: float, y: Array) -> Array:
        """Jacobian dy'/dy (2 m + n s, 2 m + n s) of :meth:`rhs`."""
        out = np.empty((self.size, self.size))
        arrays = exact_arrays(self.arrays, slider_counts(self))
        contact_jacobian.jacobian(float(t), self._checked(y), arrays, out)
        return out

    def at(self, state: Array, *, time: float = 0.0) -> Instant:
        """Forces, gaps, slip, accelerations and eigenvalues in one state y = [q, q', z].

        InputError for a state of wrong shape.
        """
        require_finite("at", time=time)
        y, m = self._checked(state), self.basis.modes
        return Instant(self, float(time), y[:m], y[m : 2 * m], y[2 * m :])

    def contact_history(self, times: Array, states: Array) -> Array:
        """Contact quantities (N, n, 6) at N times and states (N, 2 m + n s).

        The columns are normal force [N], friction force [N], penetration [m], its rate [m/s],
        slip velocity [m/s] and the rate of the ground's height under the node [m/s]; in space (N,
        n, 8), with friction force and slip velocity along the second tangent. InputError for
        states of wrong shape.
        """
        times = np.ascontiguousarray(times, dtype=float)
        states = np.ascontiguousarray(states, dtype=float)
        if times.ndim != 1 or states.shape != (len(times), self.size):
            raise InputError(f"The states at {times.size} times must have shape ({times.size}, "
                             f"{self.size}), not {states.shape}.")
        out = np.empty((len(times), self.basis.contact_nodes,
                        kernels.state_columns(self.arrays)))
        kernels.contact_history(times, states, self.arrays, out)
        return out

    def bristle_energy(self, times: Array, states: Array) -> tuple[Array, Array]:
        """Energy (N, n) that internal variables of friction store, and the power into it (N, n).

        The power [W] is that at constant normal force: what else changes the energy [J] comes from
        normal forces to which the stiffness of bristles is proportional.
        """
        out = np.zeros((2, len(times), self.basis.contact_nodes))
        if self.memory:
            bristle_history(np.ascontiguousarray(times, dtype=float),
                            np.ascontiguousarray(states, dtype=float), self.arrays, out)
        return out[0], out[1]

    def with_(
        self, changes: Mapping[str, Any] | None = None, /, **by_name: Any
    ) -> "ContactSystem":
        """A copy with other parameters, by their dotted names.

        ``system.with_({"friction.static_coefficient": 0.7, "gap": 1e-6})``; a whole part can be
        replaced too, ``system.with_(ground=Ground(speed=0.1))``. Numbers of the basis are
        ``basis.damping_ratios.I``, ``basis.damping.I.J`` and ``basis.stiffness.I.J``, for modes I
        and J from 0.

        Raises
        ------
        InputError
            If a parameter does not exist, or a value is out of range.
        """
        changes = merged(changes, by_name)
        inside = {name.removeprefix("basis."): changes.pop(name) for name in tuple(changes)
                  if name.startswith("basis.")}
        if inside:
            changes["basis"] = with_basis_parameters(changes.get("basis", self.basis), inside)
        inner = {inner_name(name): name for name in changes}
        for name in changes:
            if "." in name and inner_name(name).partition(".")[0] not in PARTS:
                raise self._unknown(name)
        wanted = {name: changes[given] for name, given in inner.items()}
        parts = {part: getattr(self, part, None) for part in {n.partition(".")[0] for n in inner}}
        try:
            if parts and parts.keys() <= {"drive", "load"}:
                return self._excited(with_parameters(parts, wanted))
            return cast("ContactSystem", with_parameters(self, wanted))
        except KeyError as error:
            raise self._unknown(inner.get(error.args[0], error.args[0])) from None

    def parameters(self) -> dict[str, Any]:
        """All parameters by their dotted names, ``{"friction.static_coefficient": 0.8, ...}``.

        Without the numbers of the basis, which :meth:`parameter` and :meth:`with_` know too, and in
        the plane without those of the third direction. Parameters of the laws of an interface:
        ``interfaces.NAME.normal.stiffness``.
        """
        hidden = IN_SPACE_ONLY if self.basis.dimension == 2 else frozenset()
        return {outer_name(self, f"{part}.{name}"): value
                for part in PARTS
                for name, value in parameters_of(getattr(self, part)).items()
                if (part != "friction" or name.partition(".")[0] not in self.basis.springs)
                and f"{part}.{name}" not in hidden}

    def parameter(self, name: str) -> Any:
        """Value of one parameter by its dotted name, as for :meth:`with_`; None where not given.

        InputError for a number that the basis does not have.
        """
        if name.startswith("basis."):
            return basis_parameter(self.basis, name.removeprefix("basis."))
        if name == "gap":
            return self.gap
        part, _, inner = name.partition(".")
        own = vars(getattr(self, part)) if part in _KINDS and name not in IN_SPACE_ONLY else {}
        value = own.get(inner)
        return value if isinstance(value, float) else self.parameters().get(name)

    def _checked(self, y: Array) -> Array:
        state = np.ascontiguousarray(y, dtype=float)
        if state.shape != (self.size,):
            raise InputError(f"A state of this system has {self.size} values [q, q', z], "
                             f"not shape {state.shape}.")
        return state

    def _unknown(self, name: str) -> InputError:
        names = tuple(one for one in (*self.parameters(), "gap", *PARTS)
                      if one != "sliding" or self.sliding)
        return InputError(f"The system has no parameter '{outer_name(self, name)}'"
                          f"{nearest(name, names)}; its parameters are: {choices(names)}.")
