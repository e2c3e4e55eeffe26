"""Numba's types of eight numbers and of eight truth values, and of arrays of such numbers."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel.models import PrimitiveModel
from numba.extending import register_model

WIDTH = 8
VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
TRUTHS = ir.VectorType(ir.IntType(1), WIDTH)


class _Lanes(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Lanes")


class _Mask(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Mask")


lanes, mask = _Lanes(), _Mask()


@register_model(_Lanes)
class _Model(PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR)


@register_model(_Mask)
class _MaskModel(PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, TRUTHS)


def lane_array(axes: int, layout: str = "C") -> Any:
    """Arrays of eight numbers each, which lie side by side as a last axis; at any address."""
    return types.Array(lanes, axes, layout, aligned=False)


def has_eight(kind: Any) -> bool:
    """Whether a type is that of eight numbers or of an array of them."""
    return kind == lanes or (isinstance(kind, types.Array) and kind.dtype == lanes)
