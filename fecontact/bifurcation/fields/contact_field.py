"""A contact system as a vector field of some of its parameters."""

from collections import OrderedDict
from collections.abc import Iterable, Mapping
from copy import copy
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from fecontact.bifurcation.fields.parametrised_system import ParametrisedSystem
from fecontact.core.checks import as_texts, require_kind
from fecontact.core.types import Array
from fecontact.laws.normal.bilateral import BilateralPolynomial
from fecontact.system import jacobian as kernels
from fecontact.system.contact_system import ContactSystem, needs_friction
from fecontact.system.elastic_sliders import without_elements
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.forcing_period import DRIVE_FREQUENCY, common_period, drive_sets_period
from fecontact.system.nodes import SystemArrays
from fecontact.system.parameter_labels import parameter_label

# Relative step of differences in a parameter.
_STEP = 2e-4
# Smallest value for that step, relative to the base value.
_LEAST_VALUE = 1e-3
# Fields over ranges that a system keeps.
_KEPT = 4
# Arrays that prescribe functions of time.
_FORCING = frozenset({"drive_parameters", "drive_shapes", "load_parameters", "load_shapes",
                      "profile_parameters", "friction_scale_parameters",
                      "ground_motion_parameters", "sliding",
                      "second_motion_parameters", "sliding_across", "wave_direction"})


class ContactField(VectorField):
    """See :func:`contact_field`; its systems are those of ``family``."""

    def __init__(self, family: ParametrisedSystem) -> None:
        self.family = family
        self.parameters = MappingProxyType(dict(family.parameters))
        self._base_values = self.values
        base = family.base
        modes = range(1, base.basis.modes + 1)
        self.state_names = (*(f"q{i}" for i in modes), *(f"q{i}'" for i in modes),
                            *(f"z{j}.{k + 1}" for j in range(base.basis.contact_nodes)
                              for k in range(base.memory)))
        self._bare = False
        varying = family.varying
        self._constant_period = varying is not None and not self._moves_forcing(varying)

    def _moves_forcing(self, varying: frozenset[str]) -> bool:
        moved = varying & _FORCING
        ground = self.family.base.ground
        steady = self.family.base.prescribed_motion.constant
        flat = not ground.wavy and ground.friction_variation is None and steady
        if flat and "profile_parameters" not in moved:
            moved = moved - {"ground_motion_parameters", "second_motion_parameters", "sliding",
                             "sliding_across"}
        return bool(moved)

    @cached_property
    def kinked(self) -> bool:
        """Whether contact forces may have kinks: all but polynomial springs without friction."""
        system = self.system()
        return needs_friction(system.basis) or not all(
            isinstance(law, BilateralPolynomial)
            for nodes, _, law in system.law_groups("normal") if nodes.stop > nodes.start)

    def system(self, values: Array | None = None) -> ContactSystem:
        """The contact system for parameter values (k,); the base values by default.

        Raises
        ------
        InputError
            If a value is out of its parameter's range.
        """
        return self.family.system(self.values if values is None else values)

    def parameter_label(self, name: str) -> str:
        """Label of a parameter, such as ``force at B x [N]`` for ``load.forces.0...amplitude``."""
        return parameter_label(name, system=self.system())

    def in_time(self) -> ContactSystem:
        """The contact system for the base values."""
        return self.system()

    def arrays(self, values: Array) -> SystemArrays:
        """Arrays of the system for kernels, for parameter values (k,)."""
        found = self.family.arrays(values)
        return without_elements(found) if self._bare else found

    def without_elements(self) -> "ContactField":
        """The field of the states [q, q'] of bodies that feel no friction.

        It has the same parameters, those of friction too.
        """
        found = copy(self)
        found._bare, found.state_names = True, self.state_names[: 2 * self.family.base.basis.modes]
        return found

    @property
    def constant_period(self) -> bool:
        """Whether no parameter of the field changes the period of the forcing."""
        return self._constant_period

    def rates(self, t: Array, x: Array, values: Array) -> Array:
        """Rates (N, d); see :meth:`VectorField.rates`."""
        f = np.empty_like(x)
        kernels.batch_rates(t, x, self.arrays(values), f)
        return f

    def derivatives(
        self, t: Array, x: Array, values: Array, active: Iterable[int] = ()
    ) -> tuple[Array, Array, Array]:
        """Rates and their derivatives; see :meth:`VectorField.derivatives`."""
        chosen = tuple(active)
        n, d = x.shape
        f, J = np.empty((n, d)), np.empty((n, d, d))
        arrays = self.arrays(values)
        if not chosen:
            kernels.batch_derivatives(t, x, arrays, arrays, 0.0, f, J, np.empty((0, 0)))
            return f, J, np.empty((n, d, 0))
        columns = []
        for index in chosen:
            column = np.empty((n, d))
            slopes = self.family.slopes(values, index, _STEP * (abs(float(values[index])) or 1.0))
            kernels.batch_derivatives(t, x, arrays, slopes, self._step(values, index), f, J, column)
            columns.append(column)
        P = columns[0][:, :, np.newaxis] if len(columns) == 1 else np.stack(columns, axis=2)
        return f, J, P

    def _step(self, values: Array, index: int) -> float:
        """Step for laws; their parameters need not be small where the value is."""
        base = abs(float(self._base_values[index]))
        return _STEP * (max(abs(float(values[index])), _LEAST_VALUE * base) or 1.0)

    def forcing_period(self, values: Array) -> float | None:
        """Common period [s] of drive, loads and ground; None where nothing depends on time.

        Raises
        ------
        AnalysisError
            If what is given in time has no common period.
        """
        return self._base_period if self._constant_period else common_period(self.system(values))

    def repeats_with_drive(self, values: Array, index: int) -> bool:
        """Whether a parameter is the drive's frequency f, and the forcing has the period 1 / f.

        Raises
        ------
        AnalysisError
            If what is given in time is not periodic.
        """
        if DRIVE_FREQUENCY in self.family.own or (
                list(self.parameters)[index] != DRIVE_FREQUENCY):
            return False
        return drive_sets_period(self.system() if len(values) == 1 else self.system(values))

    @cached_property
    def _base_period(self) -> float | None:
        return common_period(self.system())

    def displacement_row(self, point: str | int, component: str = "x") -> Array:
        """Row (d,) that gives the displacement of a point [m] from a state.

        ``point`` is 'B', 'C', a named point or the number of a contact node, ``component`` 'x',
        'y' or 'phi' (then in rad), of solids also 'z', 'phi_x', 'phi_y', 'phi_z'.

        Raises
        ------
        InputError
            For a point or a component that does not exist.
        """
        basis = self.family.base.basis
        row = np.zeros(self.dimension)
        row[: basis.modes] = basis.point_row(point, component)
        return row


def field_between(
    system: ContactSystem, ranges: tuple[tuple[str, tuple[float, float]], ...]
) -> ContactField:
    """A system as a vector field of parameters, by their names, with ranges of their values.

    The system keeps those that were used last: its responses by several methods share one.
    """
    kept = vars(system).setdefault("_fields", OrderedDict())
    found: ContactField | None = kept.pop(ranges, None)
    if found is None:
        found = ContactField(ParametrisedSystem(system, [name for name, _ in ranges],
                                                dict(ranges)))
    kept[ranges] = found
    while len(kept) > _KEPT:
        kept.popitem(last=False)
    return found


def contact_field(
    system: ContactSystem, parameters: Mapping[str, Any] | Iterable[str]
) -> ContactField:
    """A contact system as a vector field x' = f(t, x, p), x = [q, q', z].

    Parameters
    ----------
    system : ContactSystem
        Smoothed laws; the derivatives are the system's own. Laws alone are differenced, to fourth
        order, where a parameter of the field moves their parameters.
    parameters : mapping, or sequence of str
        Dotted names of the system's parameters, with values or None for the value that the system
        has; or names of your own with a pair (value, function), the function making a system from
        a system and a value::

            contact_field(system, {"ground.speed": None, "B": (10.0, with_normal_force)})

        They are set in the order given.

    Raises
    ------
    InputError
        If there is no such parameter, or it has a value per node.
    """
    require_kind("contact_field", ContactSystem, system=system)
    names = as_texts(parameters, "contact_field: names of parameters")
    return ContactField(ParametrisedSystem(
        system, parameters if isinstance(parameters, Mapping) else names))
