"""How effects together spread the plate's own properties over it: products of their fields, and what each weighs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bayesplate.effects.base import Effect, Theory
from bayesplate.modes.fields import Fabric, Field, Group, layout
from bayesplate.modes.plate import Weights
from bayesplate.modes.shear import shear_groups
from bayesplate.modes.thin import thin_groups
from bayesplate.plate.board import Values

Floats = NDArray[np.float64]

_GROUPS: tuple[Group, ...] = ("bending", "shear", "mass", "rotary")


def fabric_of(effects: Sequence[Effect]) -> Fabric:
    """What a plate is made of in the presence of effects.

    Where several vary the same property, every field of one multiplies every field of the others.
    """
    varying = [effect.fields() for effect in effects]
    outlines = [outline for effect in effects if (outline := effect.outline()) is not None]
    return Fabric(
        fields={
            group: [reduce(_times, each) for each in product(*(fields.get(group, (None,)) for fields in varying))]
            for group in _GROUPS
            if varying
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
    varying = [given for effect in effects if (given := effect.field_weights(values))]
    if not varying:
        return base
    weights: dict[Group, list[Floats]] = {
        group: [reduce(np.multiply, each) for each in product(*(w.get(group, (np.ones(1),)) for w in varying))]
        for group in _GROUPS
    }
    counts = {group: len(made) for group, made in weights.items()}
    is_turned = any(effect.turns_grain for effect in effects)
    groups = thin_groups(is_turned) if theory == "thin" else shear_groups(is_turned)

    def spread(own: Floats, group: Sequence[Group]) -> Floats:
        columns = [own[:, term] * weights[group[term]][k] for term, k in layout(group, counts)]
        return np.stack(np.broadcast_arrays(*columns), axis=-1)

    return Weights(*(spread(own, group) for own, group in zip(base, groups, strict=True)))


def _times(first: Field | None, second: Field | None) -> Field | None:
    if first is None or second is None:
        return first or second
    return lambda x, y: first(x, y) * second(x, y)
