from .buckling import BucklingLoads, buckling_loads
from .campbell import CampbellDiagram, campbell
from .comparison import Comparison, compare_runs
from .complex_modes import ComplexModes, complex_modes, prestressed_modes
from .deflections import DeflectionPath, DeflectionSteps, deflection_path
from .histories import History, history
from .impacts import Impacts, Rest, find_impacts, find_rests
from .key_numbers import KeyNumbers, key_numbers
from .mistuning import amplification, mistuned_response, whitehead_bound
from .periodicity import (
    Periodicity,
    Steadiness,
    Strobe,
    count_periods,
    periodicity,
    section_states,
    steadiness,
    strobed_states,
)
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
    "BucklingLoads",
    "CampbellDiagram",
    "Comparison",
    "ComplexModes",
    "DeflectionPath",
    "DeflectionSteps",
    "History",
    "Impacts",
    "KeyNumbers",
    "Peak",
    "Periodicity",
    "Receptance",
    "Rest",
    "Spectrogram",
    "Spectrum",
    "Steadiness",
    "Strobe",
    "amplification",
    "amplitude_spectrum",
    "buckling_loads",
    "campbell",
    "compare_runs",
    "complex_modes",
    "count_periods",
    "deflection_path",
    "find_impacts",
    "find_rests",
    "history",
    "key_numbers",
    "mistuned_response",
    "periodicity",
    "power_spectral_density",
    "prestressed_modes",
    "receptance",
    "section_states",
    "spectrogram",
    "steadiness",
    "strobed_states",
    "whitehead_bound",
]
