"""Every law that study files can name is tried by the checks of conformance."""

import pytest
from test_friction_laws import every_law
from test_memory_laws import LAWS as MEMORY_LAWS
from test_normal_laws import LAWS as NORMAL_LAWS

from fecontact.laws import FrictionLaw, NormalLaw, RigidStop, law_names

# A rigid stop has no force of the penetration; tests/integrate/test_rigid_stop.py.
TRIED = {NormalLaw: {RigidStop} | {type(law) for law, _ in NORMAL_LAWS.values()},
         FrictionLaw: {type(law) for law in (*every_law(), *MEMORY_LAWS)}}


@pytest.mark.parametrize("kind", TRIED, ids=lambda kind: kind.__name__)
def test_every_law_with_a_name_has_a_case_of_conformance(kind):
    assert set(law_names()[kind].values()) <= TRIED[kind]


@pytest.mark.parametrize("kind", law_names(), ids=lambda kind: kind.__name__)
def test_every_law_of_the_package_has_a_name(kind):
    """Classes that have a kernel, but for those that others are derived from."""
    named = set(law_names()[kind].values())
    assert named
    nameless = {law for law in below(kind)
                if law.__module__.startswith("fecontact.") and hasattr(law, "kernel")
                and not law.__name__.startswith("_") and not law.__subclasses__()} - named
    assert not nameless


@pytest.mark.parametrize("kind", law_names(), ids=lambda kind: kind.__name__)
def test_names_in_files_are_those_of_the_classes(kind):
    """In small letters, without what all of a kind have in common."""
    for name, law in law_names()[kind].items():
        title = law.__name__.removesuffix("Contact").removesuffix("Friction")
        assert name.replace("-", "") == title.lower()


def below(kind):
    """All classes that are derived from one."""
    return {law for child in kind.__subclasses__() for law in (child, *below(child))}
