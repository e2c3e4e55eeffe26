"""Statics with large deflections, among the analyses."""

from fecontact.fem.load_steps import DeflectionSteps as DeflectionSteps
from fecontact.system.statics.deflection import DeflectionPath as DeflectionPath
from fecontact.system.statics.deflection import deflection_path as deflection_path
