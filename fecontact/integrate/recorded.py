"""Contact quantities in the file of a run, by which it is drawn without its laws."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.integrate.kept_steps import KeptSteps
from fecontact.system import columns


@read_only_arrays
@dataclass(frozen=True, eq=False)
class RecordedContact:
    """Contact quantities at the outputs of a run.

    Attributes
    ----------
    contact : mapping of column to (N, n) array
        Columns of :meth:`ContactSystem.contact_history` by their numbers in
        :mod:`fecontact.system.columns`.
    contact_state : (N, n) array or None
        Values of :class:`fecontact.ContactState`.
    energy : (N,) array or None
        Energy stored in the contact [J].
    limits : tuple of str or None
        Messages of :attr:`Trajectory.limits_exceeded`.
    component : str
        Component in which the system moves most, '' where that is not recorded.
    """

    contact: Mapping[int, Array]
    contact_state: NDArray[np.int8] | None = None
    energy: Array | None = None
    limits: tuple[str, ...] | None = None
    component: str = ""

    def rows(self, chosen: Any) -> "RecordedContact":
        """Quantities at some of the outputs, without the messages about limits."""
        state, energy = (None if one is None else one[chosen]
                         for one in (self.contact_state, self.energy))
        return replace(self, contact_state=state, energy=energy, limits=None, contact={
            column: values[chosen] for column, values in self.contact.items()})

    def merged(self, kept: KeptSteps, order: Integers) -> "RecordedContact | None":
        """Forces and states of these outputs and of what was kept between them, in this order.

        None if forces were not kept, or not recorded at the outputs.
        """
        normal, friction, state = kept.normal_force, kept.friction_force, kept.contact_state
        if normal is None or friction is None:
            return None
        along = {columns.FRICTION_FORCE: friction} if friction.ndim == 2 else {
            columns.FRICTION_FORCE: friction[..., 0], columns.FRICTION_ACROSS: friction[..., 1]}
        between = {columns.NORMAL_FORCE: normal} | along
        if not between.keys() <= self.contact.keys():
            return None
        return RecordedContact(
            {column: np.concatenate([self.contact[column], values])[order]
             for column, values in between.items()},
            None if state is None or self.contact_state is None else
            np.concatenate([self.contact_state, state])[order])
