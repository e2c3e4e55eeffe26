"""The section ``[measurement]``: what virtual sensors make of the run."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fecontact.core.tables import convert_fields
from fecontact.integrate.trajectory import Trajectory
from fecontact.measured.acquisition import Acquisition, measure
from fecontact.measured.measurement import Measurement
from fecontact.measured.sensors import AnySensor, with_sensors
from fecontact.reduction.modal_basis import ModalBasis


@dataclass(frozen=True)
class MeasurementSettings(Acquisition):
    """``[measurement]``: virtual sensors, and how their channels are sampled.

    Each channel passes a Butterworth low-pass filter and is sampled; white noise is added. Masses
    of sensors act in all that the study computes.

    Parameters
    ----------
    rate_hz : float
        Sampling rate [Hz]; outputs of the run must be a multiple of it, at least four times as
        many.
    corner_hz : float, optional
        Corner frequency of the filter [Hz]; by default the sampling rate over 2.56.
    order : int
        Order of the filter; 0 for none.
    seed : int
        Seed of the noise.
    sensors : list of Accelerometer or ForceGauge
        ``[[measurement.sensors]]``: one for each channel; an accelerometer has ``point`` and
        ``direction``, a force gauge ``link`` or ``load``.

    Raises
    ------
    InputError
        For values out of range.
    """

    sensors: tuple[AnySensor, ...] = ()

    def __post_init__(self) -> None:
        convert_fields(self)
        super().__post_init__()

    def loaded(self, basis: ModalBasis, links: Mapping[str, Any]) -> ModalBasis:
        """The basis with the masses of the sensors."""
        return with_sensors(basis, self.sensors, links)

    def of(self, run: Trajectory, links: Mapping[str, Any], source: str) -> Measurement:
        """Measurement of a run of the study."""
        return measure(run, self.sensors, self, links=links, source=source)


def masses_of_sensors(settings: MeasurementSettings | None) -> tuple[AnySensor, ...]:
    """Sensors with a mass, which change the motion; the others only see it."""
    return () if settings is None else tuple(one for one in settings.sensors if one.mass)
