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
    for part in ("normal", "friction"):
        for group, table in law_tables(tables, part, where).items():
            if not isinstance(parts.get(part), dict):
                parts[part] = {}
            parts[part][group] = from_table(PART_CLASSES[part], table,
                                            f"{where}: [interfaces.{group}.{part}]")
    gap = convert(tables.get("gap", 0.0), float | tuple[float, ...], where, "gap")
    return ContactSystem(basis, gap=gap, sliding=sliding_from_tables(tables, where), **parts)


def law_tables(tables: Mapping[str, Any], part: str, where: str) -> dict[str, Any]:
    """Tables of the laws ``normal`` or ``friction`` of single interfaces, by their names."""
    return {group: one[part] for group, one in _interfaces(tables, where).items() if part in one}


def sliding_from_tables(tables: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Prescribed sliding by the names of the interfaces."""
    return {group: convert(one["sliding"], Sliding, f"{where}: [interfaces.{group}]", "sliding")
            for group, one in _interfaces(tables, where).items() if "sliding" in one}


def _interfaces(tables: Mapping[str, Any], where: str) -> Mapping[str, Mapping[str, Any]]:
    groups: Mapping[str, Mapping[str, Any]] = convert(
        tables.get("interfaces", {}), Mapping[str, Mapping[str, Any]], where, "interfaces")
    for group, one in groups.items():
        for part in one:
            require_known(part, ("normal", "friction", "sliding"),
                          f"{where}: [interfaces.{group}]")
    return groups


def system_parts(
    tables: Mapping[str, Any], where: str, names: Iterable[str]
) -> dict[str, Any]:
    """The named parts of :func:`system_tables`."""
    return {part: from_table(PART_CLASSES[part], tables.get(part, {}), f"{where}: [{part}]")
            for part in names if part in tables or part not in ("normal", "friction")}
