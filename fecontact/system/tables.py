"""A contact system's parts as tables of keys and values, and back."""

from collections.abc import Iterable, Mapping
from typing import Any

from fecontact.core.tables import convert, from_table, plain, require_known, to_table
from fecontact.laws.ground.sliding import Sliding
from fecontact.laws.registry import PART_CLASSES
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem


def system_tables(system: ContactSystem) -> dict[str, Any]:
    """Laws, ground, drive, load and gap of a contact system as tables."""
    tables: dict[str, Any] = {}
    for part in PART_CLASSES:
        given = getattr(system, part)
        if isinstance(given, Mapping):
            for group, law in given.items():
                tables.setdefault("interfaces", {}).setdefault(group, {})[part] = to_table(law)
        else:
            tables[part] = to_table(given)
    for group, one in system.sliding.items():
        tables.setdefault("interfaces", {}).setdefault(group, {})["sliding"] = to_table(one)
    tables["gap"] = plain(system.gap)
    return tables


def system_from_tables(
    basis: ModalBasis, tables: Mapping[str, Any], where: str = "The system"
) -> ContactSystem:
    """The contact system of a basis and tables ``normal``, ``friction``, ... , ``gap``."""
    parts = system_parts(tables, where, PART_CLASSES)
    groups = convert(tables.get("interfaces", {}), Mapping[str, Mapping[str, Any]], where,
                     "interfaces")
    sliding: dict[str, Any] = {}
    for group, laws in groups.items():
        for part, table in laws.items():
            place = f"{where}: [interfaces.{group}]"
            require_known(part, ("normal", "friction", "sliding"), place)
            if part == "sliding":
                sliding[group] = convert(table, Sliding, place, part)
                continue
            if not isinstance(parts.get(part), dict):
                parts[part] = {}
            parts[part][group] = from_table(PART_CLASSES[part], table,
                                            f"{where}: [interfaces.{group}.{part}]")
    gap = convert(tables.get("gap", 0.0), float | tuple[float, ...], where, "gap")
    return ContactSystem(basis, gap=gap, sliding=sliding, **parts)


def system_parts(
    tables: Mapping[str, Any], where: str, names: Iterable[str]
) -> dict[str, Any]:
    """The named parts of :func:`system_tables`."""
    return {part: from_table(PART_CLASSES[part], tables.get(part, {}), f"{where}: [{part}]")
            for part in names if part in tables or part != "normal"}
