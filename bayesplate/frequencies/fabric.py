"""How effects together spread the plate's own properties over it: products of their fields, and what each weighs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, reduce
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bayesplate.effects.base import Effect, Theory, Variation
from bayesplate.modes.fields import Fabric, Field, Group, layout
from bayesplate.modes.plate import Weights
from bayesplate.modes.shear import shear_groups
from bayesplate.modes.thin import thin_groups
from bayesplate.plate.board import Values

Floats = NDArray[np.float64]

_GROUPS: tuple[Group, ...] = ("bending", "shear", "mass", "rotary")


Joined = tuple[Variation, ...]
"""One field of a property where several effects vary it: the product of one variation per effect."""


@lru_cache(maxsize=32)
def _joined(effects: tuple[Effect, ...]) -> dict[Group, list[Joined]]:
    """Every variation of one effect with every one of the others, by group; empty where no effect varies anything.

    Fields and weights are both read from this one list.
    """
    varying = [variations for effect in effects if (variations := effect.variations())]
    if not varying:
        return {}
    uniform = (Variation(None),)
    return {group: list(product(*(each.get(group, uniform) for each in varying))) for group in _GROUPS}


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


def over_fields(base: Weights, effects: Sequence[Effect], theory: Theory, values: Values) -> Weights:
    """Weights of the plate's own terms, once for each field that they take.

    Parameters
    ----------
    base : Weights
        (n_draws, n_own) arrays, of the plate's own terms once each.
    effects : sequence of Effect
        As given to `fabric_of`.
    theory : "thin" or "shear-flexible"
    values : dict of array

    Returns
    -------
    Weights
        In the order of `bayesplate.modes.fields.layout`.
    """
    varying = _joined(tuple(effects))
    if not any(one.weight for each in varying.values() for joined in each for one in joined):
        return base
    weights = {group: [_weight(joined, values) for joined in each] for group, each in varying.items()}
    counts = {group: len(made) for group, made in weights.items()}
    is_turned = any(effect.turns_grain for effect in effects)
    groups = thin_groups(is_turned) if theory == "thin" else shear_groups(is_turned)

    def spread(own: Floats, group: Sequence[Group]) -> Floats:
        columns = [own[:, term] * weights[group[term]][k] for term, k in layout(group, counts)]
        return np.stack(np.broadcast_arrays(*columns), axis=-1)

    return Weights(*(spread(own, group) for own, group in zip(base, groups, strict=True)))


def _weight(joined: Joined, values: Values) -> Floats:
    return reduce(np.multiply, (one.weight(values) for one in joined if one.weight), np.ones(1))


def _times(first: Field | None, second: Field | None) -> Field | None:
    if first is None or second is None:
        return first or second
    return lambda x, y: first(x, y) * second(x, y)
