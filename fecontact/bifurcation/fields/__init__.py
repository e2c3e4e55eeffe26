"""Vector fields; what of them runs in time without contact stands in ``system.fields``."""

from fecontact.system.fields.function_field import vector_field
from fecontact.system.fields.vector_field import VectorField

__all__ = ["VectorField", "vector_field"]
