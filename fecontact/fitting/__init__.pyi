from .data import Curve, FitData, FunctionData
from .data_in_time import DecayData, HistoryData, LoopData
from .data_of_modes import BackboneData, FrequencyData, ReceptanceData, ResponseData
from .from_study import fit_study, study_data
from .posterior import Posterior, posterior
from .problem import Problem
from .profile import ProfileLikelihood, profile_likelihood
from .result import Fit, FitStart
from .search import SearchOptions

__all__ = [
    "BackboneData",
    "Curve",
    "DecayData",
    "Fit",
    "FitData",
    "FitStart",
    "FrequencyData",
    "FunctionData",
    "HistoryData",
    "LoopData",
    "Posterior",
    "Problem",
    "ProfileLikelihood",
    "ReceptanceData",
    "ResponseData",
    "SearchOptions",
    "fit_study",
    "posterior",
    "profile_likelihood",
    "study_data",
]
