from .complex_modes import ComplexModes, complex_modes, prestressed_modes
from .histories import History, history
from .impacts import Impacts, Rest, find_impacts, find_rests
from .periodicity import Periodicity, Strobe, count_periods, periodicity, strobed_states
from .receptance import Receptance, receptance
from .spectra import (
    Peak,
    Spectrogram,
    Spectrum,
    amplitude_spectrum,
    power_spectral_density,
    spectrogram,
)

__all__ = [
    "ComplexModes",
    "History",
    "Impacts",
    "Peak",
    "Periodicity",
    "Receptance",
    "Rest",
    "Spectrogram",
    "Spectrum",
    "Strobe",
    "amplitude_spectrum",
    "complex_modes",
    "count_periods",
    "find_impacts",
    "find_rests",
    "history",
    "periodicity",
    "power_spectral_density",
    "prestressed_modes",
    "receptance",
    "spectrogram",
    "strobed_states",
]
