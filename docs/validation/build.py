"""Writes docs/validation.md and its pictures: ``make validation``."""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "cases"))

import continuation_cases
import eigenfrequencies
import friction_cases
import friction_section
import half_spaces_section
import impact_section
import large_deflections_section
import line_contact_section
import normal_contact
import responses_section
import sliding_solids_section
import solids_section
import tori_cases
import turning_section
import two_bodies_section
import two_mass_section

from fecontact.core.files.atomic_write import write_text

DOCS = Path(__file__).resolve().parents[1]
HEAD = """# Validation

Results of the package compared with closed forms, published numbers and the figures of W. Sextro,
*Dynamical Contact Problems with Friction*, chapter 4. `make validation` computes all results
in about ten minutes on two cores and writes this page. The scripts named here are in
`docs/validation/cases`; each can be run alone and draws its pictures.

"""


def main() -> None:
    """Compute all sections, then write the page."""
    images = DOCS / "images" / "validation"
    images.mkdir(parents=True, exist_ok=True)
    parts = []
    for name, make in (("eigenfrequencies", eigenfrequencies.section),
                       ("impacts of one mass", normal_contact.section),
                       ("friction of one mass", friction_cases.section),
                       ("line contact", lambda: line_contact_section.section(images)),
                       ("two bodies", lambda: two_bodies_section.section(images)),
                       ("solids", lambda: solids_section.section(images)),
                       ("half-spaces", half_spaces_section.section),
                       ("sliding solids", lambda: sliding_solids_section.section(images)),
                       ("bodies that turn or repeat", turning_section.section),
                       ("large deflections", large_deflections_section.section),
                       ("continuation", continuation_cases.section),
                       ("quasi-periodic motions", tori_cases.section),
                       ("frequency responses", lambda: responses_section.section(images)),
                       ("section 4.2", lambda: impact_section.section(images)),
                       ("section 4.3", lambda: friction_section.section(images)),
                       ("section 4.4", lambda: two_mass_section.section(images))):
        begin, work = time.perf_counter(), time.process_time()
        print(f"{name} ...", end=" ", flush=True)
        parts.append(make())
        print(f"{time.perf_counter() - begin:.0f} s, {time.process_time() - work:.0f} s of all "
              f"processors", flush=True)
    write_text(DOCS / "validation.md", HEAD + "\n".join(parts))


if __name__ == "__main__":
    main()
