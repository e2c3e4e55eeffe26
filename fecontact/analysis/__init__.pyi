from .complex_modes import ComplexModes, complex_modes, prestressed_modes
from .histories import history
from .impacts import Impacts, Rest, find_impacts, find_rests
from .periodicity import Periodicity, count_periods, periodicity, strobed_states
from .receptance import Receptance, receptance
from .spectra import Peak, amplitude_spectrum, power_spectral_density, spectrogram

__all__ = [
    "ComplexModes",
    "Impacts",
    "Peak",
    "Periodicity",
    "Receptance",
    "Rest",
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
