"""Numba's types of eight numbers and of eight truth values, and of arrays of such numbers."""

import math
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.datamodel.models import PrimitiveModel
from numba.extending import register_model

from fecontact.core.types import Array

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


def zeros_of_eight(*shape: int) -> Array:
    """Zeros (*shape, 8) at an address of which each eight numbers are in one line of the cache."""
    size, line = WIDTH * math.prod(shape), WIDTH * 8
    room = np.zeros(size + WIDTH)
    first = -room.ctypes.data % line // 8
    return room[first : first + size].reshape(*shape, WIDTH)
