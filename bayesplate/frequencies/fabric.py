"""How effects together spread the plate's own properties over it: products of their fields, and what each weighs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, reduce
from itertools import product

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Effect, Theory, Variation
from bayesplate.frequencies.terms import along_grain
from bayesplate.plate.fields import EdgeStrip, Fabric, Field, Group, layout
from bayesplate.plate.shear import SHEAR_FLEXIBLE
from bayesplate.plate.terms import Weights
from bayesplate.plate.thin import THIN

_GROUPS: tuple[Group, ...] = ("along", "bending", "shear", "mass", "rotary")

HIGHEST_ORDER = 2
"""Of the smallness of a product of variations that counts."""

_UNIFORM = (Variation(None),)

Joined = tuple[Variation, ...]
"""One field of a property where several effects vary it: the product of one variation per effect."""


@lru_cache(maxsize=32)
def _joined(effects: tuple[Effect, ...]) -> dict[Group, list[Joined]]:
    """Every variation of one effect with every one of the others, by group; empty where no effect varies anything.

    What is smaller than expansions go is left out.
    Fields and weights are both read from this one list. What an effect does to bending it does along the grain too,
    unless it says otherwise.
    """
    varying = [variations for effect in effects if (variations := effect.variations())]
    if not varying:
        return {}
    whole = [{"along": each.get("bending", _UNIFORM), **each} for each in varying]
    every = {group: product(*(each.get(group, _UNIFORM) for each in whole)) for group in _GROUPS}
    return {
        group: [joined for joined in each if sum(one.order for one in joined) <= HIGHEST_ORDER]
        for group, each in every.items()
    }


def fabric_of(effects: Sequence[Effect]) -> Fabric:
    """What a plate is made of in the presence of effects.

    Where several vary the same property, every field of one multiplies every field of the others.
    """
    outlines = [outline for effect in effects if (outline := effect.outline()) is not None]
    return Fabric(
        fields={
            group: [reduce(_times, (one.field for one in joined)) for joined in each]
            for group, each in _joined(tuple(effects)).items()
        },
        outline=outlines[0] if outlines else None,
        is_turned=any(effect.turns_grain for effect in effects),
    )


def in_plane(effects: Sequence[Effect], values: Values) -> Field | None:
    """The field that the in-plane stiffness follows at one draw of values; None where it is uniform.

    It goes with the thickness and with the moduli, as the shear stiffness does. What an outline takes away at the edges
    is left in.
    """
    joined = _joined(tuple(effects)).get("shear", [])
    shares = [
        (float(_weight(one, values)[0]), tuple(_fields(one)))
        for one in joined
        if not any(isinstance(each, EdgeStrip) for each in _fields(one))
    ]
    if not any(field for _, fields in shares for field in fields):
        return None
    return _Sum(tuple(shares))


def over_fields(base: Weights, effects: Sequence[Effect], theory: Theory, values: Values, setup: Setup) -> Weights:
    """Weights of the plate's own terms in the presence of effects, once for each field, in the order of `layout`.

    `base` has each term once, without effects. The part of the modulus along the grain takes fields of its own, and is
    turned with the grain as all the rest.
    """
    varying = _joined(tuple(effects))
    whole = _reweighed(base, effects, values, setup)
    if not any(one.weight for each in varying.values() for joined in each for one in joined):
        return whole
    along = _reweighed(along_grain(base, values, setup), effects, values, setup).stiffness
    weights = {group: [_weight(joined, values) for joined in each] for group, each in varying.items()}
    others = dict(zip(map(_fields, varying["bending"]), weights["bending"], strict=True))
    # On each field along the grain, what all other moduli weigh on it: nothing where it is no field of theirs.
    rest = [others.get(_fields(joined), np.zeros(1)) for joined in varying["along"]]
    counts = {group: len(made) for group, made in weights.items()}
    is_turned = any(effect.turns_grain for effect in effects)
    groups = (THIN if theory == "thin" else SHEAR_FLEXIBLE).groups(is_turned)

    def stiffness(term: int, k: int) -> Floats:
        own, group = whole.stiffness[:, term], groups[0][term]
        if group == "along":
            return along[:, term] * weights[group][k] + (own - along[:, term]) * rest[k]
        return own * weights[group][k]

    def mass(term: int, k: int) -> Floats:
        return whole.mass[:, term] * weights[groups[1][term]][k]

    def spread(weight: Callable[[int, int], Floats], group: Sequence[Group]) -> Floats:
        return np.stack(np.broadcast_arrays(*(weight(*each) for each in layout(group, counts))), axis=-1)

    return Weights(spread(stiffness, groups[0]), spread(mass, groups[1]))


def _reweighed(base: Weights, effects: Sequence[Effect], values: Values, setup: Setup) -> Weights:
    return reduce(lambda weights, effect: effect.reweigh(weights, values, setup), effects, base)


def _fields(joined: Joined) -> tuple[Field | EdgeStrip | None, ...]:
    return tuple(one.field for one in joined)


def _weight(joined: Joined, values: Values) -> Floats:
    return reduce(np.multiply, (one.weight(values) for one in joined if one.weight), np.ones(1))


def _times(first: Field | EdgeStrip | None, second: Field | EdgeStrip | None) -> Field | EdgeStrip | None:
    if first is None or second is None:
        return first or second
    if isinstance(first, EdgeStrip):
        first, second = second, first
    if isinstance(first, EdgeStrip):
        raise ValueError("fields: wanted one strip along the outline, got two")
    if isinstance(second, EdgeStrip):
        return replace(second, field=_product(first, second.field))
    return _product(first, second)


def _product(first: Field, second: Field | None) -> Field:
    return first if second is None else _Product(first, second)


@dataclass(frozen=True)
class _Sum:
    """Products of fields, each with its share; None is uniform."""

    shares: tuple[tuple[float, tuple[Field | EdgeStrip | None, ...]], ...]

    def __call__(self, x: Floats, y: Floats) -> Floats:
        total = np.zeros(np.broadcast_shapes(np.shape(x), np.shape(y)))
        for share, fields in self.shares:
            total = total + share * reduce(np.multiply, (one(x, y) for one in fields if callable(one)), np.ones(1))
        return total


@dataclass(frozen=True)
class _Product:
    first: Field
    second: Field

    def __call__(self, x: Floats, y: Floats) -> Floats:
        return self.first(x, y) * self.second(x, y)
