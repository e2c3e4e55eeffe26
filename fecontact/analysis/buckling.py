"""Buckling of elastic bodies, among the analyses."""

from fecontact.system.statics.buckling import BucklingLoads as BucklingLoads
from fecontact.system.statics.buckling import buckling_loads as buckling_loads
