"""The section ``[preload]``: quasi-static loading before a run."""

from dataclasses import dataclass, fields
from typing import Annotated, Any

from fecontact.core.errors import InputError
from fecontact.core.units import Unit
from fecontact.system.contact_system import ContactSystem
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.path import LoadPath


@dataclass(frozen=True)
class PreloadSettings(LoadPath):
    """``[preload]``: a path of loads with friction that keeps its history.

    See :func:`fecontact.load_history`; ``initial = "preload"`` of ``[simulation]`` begins a run at
    its end.

    Parameters
    ----------
    load_scale : float or list
        Factor of constant loads [-]; one number, or one for each vertex of the path, as below.
    forces : mapping of text to float or list, or list of these, optional
        Forces and moments by point and component, ``{"C.x" = [0.0, 30.0]}`` [N], [N m]; or the
        values of ``load.forces``, in their order. By default their constant parts.
    motion_x, motion_y, motion_z : float or list, optional
        Displacements of the driven ends of the springs at B [m], along z of solids; by default
        their constant parts.
    travel : float or list
        Travel of the ground in +x [m], or of the one interface that slides, along its velocity
        [m], [rad].
    travel_y : float or list, optional
        Travel of the ground in +y below solids [m]; zero by default.
    steps : int or list
        Increments between two vertices, of each of the sections if it is a list.
    tangential_ratio : float
        Tangential over normal stiffness of stuck contacts [-], ``inf`` for rigid sticking; not for
        Jenkins and Iwan friction, which have springs of their own.
    tangential_stiffness : float or list, optional
        Tangential stiffness of stuck contacts of the whole face, or of each node [N/m], instead of
        the ratio.
    rtol : float
        Relative error of work and loss of an increment.
    """

    tangential_ratio: float = 0.82
    tangential_stiffness: Annotated[float | tuple[float, ...] | None, Unit("N/m")] = None
    rtol: float = 1e-6

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.tangential_ratio > 0.0:
            raise InputError(f"PreloadSettings: tangential_ratio = {self.tangential_ratio!r} must "
                             f"be above zero; inf for rigid sticking.")

    def load(self, system: ContactSystem) -> LoadHistory:
        """The loading of a system along this path."""
        # Its kernels are compiled for studies that need them only.
        from fecontact.system.quasistatic.loading import load_history

        given: dict[str, Any] = {entry.name: getattr(self, entry.name)
                                 for entry in fields(LoadPath)}
        return load_history(system, LoadPath(**given), tangential_ratio=self.tangential_ratio,
                            tangential_stiffness=self.tangential_stiffness, rtol=self.rtol)
