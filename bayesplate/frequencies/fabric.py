"""The plate's own properties as fields over it where several effects vary them: products of fields, with weights."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, reduce
from itertools import product

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Effect, Variation
from bayesplate.frequencies.terms import along_grain
from bayesplate.plate.fields import EdgeStrip, Fabric, Field, TermGroup, term_field_pairs
from bayesplate.plate.shear import SHEAR_FLEXIBLE
from bayesplate.plate.terms import Theory, Weights
from bayesplate.plate.thin import THIN

_GROUPS: tuple[TermGroup, ...] = ("along", "bending", "shear", "mass", "rotary")

HIGHEST_ORDER = 2
"""Highest order of smallness of a product of variations that is taken into account."""

_UNIFORM = (Variation(None),)

VariationProduct = tuple[Variation, ...]
"""A field of a property that several effects vary: the product of one variation of each effect."""


@lru_cache(maxsize=32)
def _variation_products(effects: tuple[Effect, ...]) -> dict[TermGroup, list[VariationProduct]]:
    """Every product of one variation of each effect, by group; empty where no effect varies anything.

    Products of an order of smallness above `HIGHEST_ORDER` are left out. Fields and weights are both read from this
    list. A variation of bending applies along the grain too, unless the effect has another one there.
    """
    varying = [variations for effect in effects if (variations := effect.variations())]
    if not varying:
        return {}
    complete = [{"along": variations.get("bending", _UNIFORM), **variations} for variations in varying]
    products = {group: product(*(variations.get(group, _UNIFORM) for variations in complete)) for group in _GROUPS}
    return {
        group: [factors for factors in group_products if sum(factor.order for factor in factors) <= HIGHEST_ORDER]
        for group, group_products in products.items()
    }


def fabric_of(effects: Sequence[Effect]) -> Fabric:
    """Fields, outline and grain of a plate in the presence of effects.

    Where several effects vary the same property, every field of one multiplies every field of the others.
    """
    outlines = [outline for effect in effects if (outline := effect.outline()) is not None]
    return Fabric(
        fields={
            group: [reduce(_multiply_fields, (factor.field for factor in factors)) for factors in products]
            for group, products in _variation_products(tuple(effects)).items()
        },
        outline=outlines[0] if outlines else None,
        is_turned=any(effect.turns_grain for effect in effects),
    )


def in_plane_field(effects: Sequence[Effect], values: Values) -> Field | None:
    """The field that the in-plane stiffness follows at one draw of values; None where it is uniform.

    It varies with the thickness, as the shear stiffness does. The strips by which an outline is uncertain are left out.
    """
    products = _variation_products(tuple(effects)).get("shear", [])
    shares = [
        (float(_product_weight(factors, values)[0]), tuple(_fields(factors)))
        for factors in products
        if not any(isinstance(field, EdgeStrip) for field in _fields(factors))
    ]
    if not any(field for _, fields in shares for field in fields):
        return None
    return _FieldSum(tuple(shares))


def spread_over_fields(
    base: Weights, effects: Sequence[Effect], theory: Theory, values: Values, setup: Setup
) -> Weights:
    """Weights of the plate's own terms in the presence of effects, one for each field, as of `term_field_pairs`.

    `base` has each term once, without effects. The part due to the modulus along the grain has fields of its own, and
    turns with the grain like all other parts.
    """
    products = _variation_products(tuple(effects))
    reweighed = _reweighed(base, effects, values, setup)
    if not any(
        factor.weight for group_products in products.values() for factors in group_products for factor in factors
    ):
        return reweighed
    along = _reweighed(along_grain(base, values, setup), effects, values, setup).stiffness
    weights = {
        group: [_product_weight(factors, values) for factors in group_products]
        for group, group_products in products.items()
    }
    bending_weights = dict(zip(map(_fields, products["bending"]), weights["bending"], strict=True))
    # The weight of all other moduli on each field of the modulus along the grain: zero where they do not have it.
    other_weights = [bending_weights.get(_fields(factors), np.zeros(1)) for factors in products["along"]]
    counts = {group: len(group_weights) for group, group_weights in weights.items()}
    is_turned = any(effect.turns_grain for effect in effects)
    groups = (THIN if theory == "thin" else SHEAR_FLEXIBLE).groups(is_turned)

    def stiffness(term: int, k: int) -> Floats:
        term_weight, group = reweighed.stiffness[:, term], groups[0][term]
        if group == "along":
            return along[:, term] * weights[group][k] + (term_weight - along[:, term]) * other_weights[k]
        return term_weight * weights[group][k]

    def mass(term: int, k: int) -> Floats:
        return reweighed.mass[:, term] * weights[groups[1][term]][k]

    def spread(weight: Callable[[int, int], Floats], group: Sequence[TermGroup]) -> Floats:
        return np.stack(np.broadcast_arrays(*(weight(*place) for place in term_field_pairs(group, counts))), axis=-1)

    return Weights(spread(stiffness, groups[0]), spread(mass, groups[1]))


def _reweighed(base: Weights, effects: Sequence[Effect], values: Values, setup: Setup) -> Weights:
    return reduce(lambda weights, effect: effect.reweigh(weights, values, setup), effects, base)


def _fields(factors: VariationProduct) -> tuple[Field | EdgeStrip | None, ...]:
    return tuple(factor.field for factor in factors)


def _product_weight(factors: VariationProduct, values: Values) -> Floats:
    return reduce(np.multiply, (factor.weight(values) for factor in factors if factor.weight), np.ones(1))


def _multiply_fields(first: Field | EdgeStrip | None, second: Field | EdgeStrip | None) -> Field | EdgeStrip | None:
    if first is None or second is None:
        return first or second
    if isinstance(first, EdgeStrip):
        first, second = second, first
    if isinstance(first, EdgeStrip):
        raise ValueError("fields: wanted one strip along the outline, got two")
    if isinstance(second, EdgeStrip):
        return replace(second, field=_scale_field(first, second.field))
    return _scale_field(first, second)


def _scale_field(first: Field, second: Field | None) -> Field:
    return first if second is None else _FieldProduct(first, second)


@dataclass(frozen=True)
class _FieldSum:
    """Sum of products of fields, each product with its share; None is a uniform field."""

    shares: tuple[tuple[float, tuple[Field | EdgeStrip | None, ...]], ...]

    def __call__(self, x: Floats, y: Floats) -> Floats:
        total = np.zeros(np.broadcast_shapes(np.shape(x), np.shape(y)))
        for share, fields in self.shares:
            total = total + share * reduce(
                np.multiply, (field(x, y) for field in fields if callable(field)), np.ones(1)
            )
        return total


@dataclass(frozen=True)
class _FieldProduct:
    first: Field
    second: Field

    def __call__(self, x: Floats, y: Floats) -> Floats:
        return self.first(x, y) * self.second(x, y)
