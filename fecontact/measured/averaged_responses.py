"""Frequency responses from averaged spectra of measured histories."""

from dataclasses import replace

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_positive
from fecontact.measured.measurement import Measurement

_OVERLAP = 0.875  # of successive segments


def averaged_responses(
    measurement: Measurement, force: str | int, *, segment: float
) -> Measurement:
    r"""Responses of all other channels to a force over frequency, by the estimator H1.

    .. math:: H_1(f) = \frac{S_{fx}(f)}{S_{ff}(f)}, \qquad
        \gamma^2(f) = \frac{|S_{fx}|^2}{S_{ff} S_{xx}}

    Spectra are means over Hann-windowed segments that overlap by seven eighths. Noise of the
    responses averages out; noise of the force makes H1 too small.

    Parameters
    ----------
    measurement : Measurement
        Channels over time, evenly sampled.
    force : str or int
        Channel of the force, by name or number.
    segment : float
        Length of the segments [s]; its inverse is the distance of the frequencies. At least 16
        samples, and at most half of the measurement, so that there is something to average.

    Returns
    -------
    Measurement
        Complex responses over frequency, with their coherence; units are those of the channels
        over that of the force.

    Raises
    ------
    InputError
        For measurements over frequency, a channel that does not exist, a single channel, values
        that are missing, uneven times, or a segment out of range.
    """
    require_kind("averaged_responses", Measurement, measurement=measurement)
    require_positive("averaged_responses", segment=segment)
    pushed = measurement.index(force)
    t, push, force_unit, name = measurement.series(pushed)
    others = [k for k in range(len(measurement.channels)) if k != pushed]
    if not others:
        raise InputError(f"averaged_responses: the measurement has no channel beside the force "
                         f"'{name}'; give one with a response too.")
    steps = np.diff(t)
    if np.abs(steps - steps.mean()).max() > 1e-3 * steps.mean():
        raise InputError("averaged_responses: the times are not evenly spread; sample the "
                         "measurement evenly first.")
    count = round(segment / float(steps.mean()))
    if not 16 <= count <= len(t) // 2:
        raise InputError(f"averaged_responses: segment = {segment:g} s must be from "
                         f"{16 * steps.mean():.3g} s, 16 samples, to {0.5 * (t[-1] - t[0]):.3g} s, "
                         f"half of the measurement.")
    from scipy.signal import csd, welch

    how = {"fs": 1.0 / float(steps.mean()), "nperseg": count, "noverlap": int(_OVERLAP * count)}
    hertz, own = welch(push, **how)
    if not own.all():
        raise InputError(f"averaged_responses: the force '{name}' has no content at "
                         f"{hertz[np.argmin(own)]:.4g} Hz, to which responses would refer; is it "
                         f"zero throughout?")
    seen = [measurement.series(k)[1] for k in others]
    values = np.stack([csd(push, one, **how)[1] / own for one in seen], axis=1)
    power = np.stack([welch(one, **how)[1] for one in seen], axis=1)
    coherence = np.divide(np.abs(values) ** 2 * own[:, None], power, out=np.zeros_like(power),
                          where=power > 0.0)
    excited = measurement.channels[pushed]
    channels = tuple(replace(
        measurement.channels[k], unit=f"{measurement.channels[k].unit}/{force_unit}",
        reference_node=excited.node, reference_direction=excited.direction) for k in others)
    return Measurement(hertz, values, channels, "frequency", np.minimum(coherence, 1.0),
                       measurement.source, (*measurement.notes, (
                           f"H1 of {1 + (len(t) - count) // (count - how['noverlap'])} segments of "
                           f"{count} samples")))


