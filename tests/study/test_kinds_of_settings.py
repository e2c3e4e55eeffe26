"""Sections of a study built in Python: values of the wrong kind are refused by name."""

import math
from dataclasses import MISSING, dataclass, fields
from typing import ClassVar

import pytest

from fecontact.bifurcation.diagram_options import BranchSettings
from fecontact.bifurcation.response_options import ResponseSettings
from fecontact.core.errors import FecontactError, InputError
from fecontact.core.tables import convert_fields
from fecontact.integrate import ContactEvents
from fecontact.study import RenderSettings, sections
from fecontact.study.bodies_section import BodyBasisSettings, Placement
from fecontact.study.geometry_section import MeshFile
from fecontact.study.sweep_section import SweepSettings

SECTIONS = (
    sections.BodySettings, sections.BasisSettings, sections.SimulationSettings,
    sections.WearSettings, sections.OutputSettings, RenderSettings, Placement,
    BodyBasisSettings, SweepSettings, ResponseSettings, BranchSettings, MeshFile, ContactEvents,
)
WRONG = (None, "x", object(), 1j, ["a", "b"], [[1], [2, 3]], [None], (1,), {}, math.nan, -1, 0, 1.5,
         True)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_values_of_all_kinds_are_taken_or_refused_by_name(section):
    entries, told = fields(section), []
    needed = {entry.name: "x" for entry in entries
              if entry.default is MISSING and entry.default_factory is MISSING}
    for entry in entries:
        for value in WRONG:
            try:
                section(**{**needed, entry.name: value})
            except FecontactError as error:
                told.append((entry.name, str(error)))
    assert len(told) >= len(entries)
    assert [pair for pair in told if pair[0] not in pair[1]] == []


def test_values_become_what_a_file_would_give():
    found = RenderSettings(size=[640, 360], fps=25)
    assert found.size == (640, 360)
    assert found == RenderSettings(size=(640, 360), fps=25.0)
    with pytest.raises(InputError, match=r'RenderSettings: frames = "many" must be a whole number'):
        RenderSettings(frames="many")


def test_class_variables_are_no_fields():
    @dataclass(frozen=True)
    class Section:
        rate: float
        kernel: ClassVar = "any"
        most: ClassVar[int] = "three"

        def __post_init__(self):
            convert_fields(self)

    found = Section(2)
    assert type(found.rate) is float
    assert vars(found) == {"rate": 2.0}
    assert (found.kernel, found.most) == ("any", "three")
    with pytest.raises(InputError, match='Section: rate = "fast" must be a number'):
        Section("fast")
