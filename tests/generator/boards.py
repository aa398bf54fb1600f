"""Boards with planted effects: constants drawn around spruce, effects of a size, noise, and a card to read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from generator.card import NOISE_FACTOR, NOTHING, card_text
from generator.designs import DESIGNS, MEDIANS, POISSON, Design
from generator.naming import LEAST_CORRELATION, Label, frequencies
from generator.recipes import KNOWN_SIZE, RECIPES

MOST_DRAWS = 200


@dataclass(frozen=True)
class Truth:
    """What is true of a planted board.

    Attributes
    ----------
    constants : dict
        E_x, E_y, G_xy, Pa, and nu_xy as tabulated (a planted poisson_ratio replaces it).
    effects : dict
        Name -> parameters, SI units; empty for an ideal board.
    size : dict
        Name -> multiple of the design's nominal size.
    noise_cents : float
        Standard deviation of the readings; where it was drawn, the median of what it was drawn from.
    drawn_noise : dict
        Setup name -> standard deviation of its readings, cents, where it was drawn; empty where it was not.
    """

    constants: dict[str, float]
    effects: dict[str, dict[str, Any]]
    size: dict[str, float]
    noise_cents: float
    drawn_noise: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class PlantedBoard:
    """A simulated board.

    Attributes
    ----------
    name : str
    design : Design
    truth : Truth
    readings : dict
        Setup name -> laboratory's label -> Hz, with noise.
    exact : dict
        The same without noise.
    n_draws : int
        How many boards were drawn until every label was beyond doubt.
    sensor : (float, float) or None, m
        Place of a sensor or exciter that the card mentions, without its mass, whether or not it weighs anything.
    noise_factor : float
        Of the noise prior that the card states.
    resolution : float, Hz
        Readings are rounded to this, and the card says so; 0 if they are not.
    """

    name: str
    design: Design
    truth: Truth
    readings: dict[str, dict[Label, float]]
    exact: dict[str, dict[Label, float]]
    n_draws: int
    sensor: tuple[float, float] | None = None
    noise_factor: float = NOISE_FACTOR
    resolution: float = 0.0

    def card_text(self, stated: Mapping[str, str] = NOTHING) -> str:
        """The board card, which tells nothing of the truth but the noise and the places of what is attached.

        Unless it is told more: see `generator.card.card_text`.
        """
        places, driven = (
            self.truth.effects.get(effect, {}).get("places", ()) for effect in ("attached_mass", "exciter")
        )
        if self.sensor is not None:
            places, driven = (self.sensor,), ()
        return card_text(
            self.name,
            self.design,
            self.readings,
            noise_cents=self.truth.noise_cents,
            noise_factor=self.noise_factor,
            resolution=self.resolution,
            places=places,
            driven=driven,
            outline=self.truth.effects.get("outline_profile"),
            stated=stated,
        )

    def shifts(self) -> dict[str, dict[Label, float]]:
        """What the effects do, against the ideal board of the same constants: setup -> label -> cents, no noise."""
        ideal = _frequencies(self.design, self.truth.constants, {})[0]
        return {
            setup: {label: 1200.0 * float(np.log2(hz / ideal[setup][label])) for label, hz in exact.items()}
            for setup, exact in self.exact.items()
        }


def plant(
    rng: np.random.Generator,
    design: Design | str,
    effects: Sequence[str],
    size: float = 1.0,
    noise_cents: float = 5.0,
    *,
    name: str = "planted",
    scale_known: bool = False,
    n_places: int = 1,
    fixed: Mapping[str, Mapping[str, Any]] | None = None,
    sensor: tuple[float, float] | None = None,
    noise_factor: float = NOISE_FACTOR,
    constants: Mapping[str, float] | None = None,
    noise_is_drawn: bool = False,
    resolution: float = 0.0,
) -> PlantedBoard:
    """Simulate a board of a design with effects, drawn again until every label is beyond doubt.

    size multiplies the design's nominal sizes, those of `KNOWN_SIZE` too if scale_known; an attached mass or an exciter
    roves over n_places; fixed: effect -> parameters that are not drawn, SI units; sensor: a place on the whole board,
    m, that the card mentions in any case, where a planted mass or exciter sits; noise_factor: of the noise prior on the
    card, whose median is noise_cents, and from which the true noise of each setup comes if noise_is_drawn; constants:
    E_x, E_y, G_xy, Pa, if they are not to be drawn; resolution, Hz, to which readings are rounded, and no two of one
    setup the same. ValueError if an effect is unknown or acts in no setup of the design.
    """
    design = DESIGNS[design] if isinstance(design, str) else design
    _refuse_wrong(effects, design)
    settled = {effect: dict(values) for effect, values in (fixed or {}).items()}
    if sensor is not None:
        for effect in ("attached_mass", "exciter"):
            settled.setdefault(effect, {})["places"] = (sensor,)
    for n_draws in range(1, MOST_DRAWS + 1):
        true = _draw_constants(rng) if constants is None else {"nu_xy": POISSON, **constants}
        sizes = {effect: size if scale_known or effect not in KNOWN_SIZE else 1.0 for effect in effects}
        drawn = {effect: RECIPES[effect].draw(rng, design, sizes[effect]) for effect in effects}
        for effect in ("attached_mass", "exciter"):
            if n_places > 1 and effect in drawn:
                more = [RECIPES[effect].draw(rng, design, 1.0)["places"][0] for _ in range(n_places - 1)]
                drawn[effect]["places"] += tuple(more)
        drawn = {effect: values | settled.get(effect, {}) for effect, values in drawn.items()}
        exact, correlation = _frequencies(design, true, drawn)
        if correlation < LEAST_CORRELATION:
            continue
        levels = _noise_levels(rng, design, noise_cents, noise_factor) if noise_is_drawn else {}
        readings = {
            setup: _read(rng, hertz, levels.get(setup, noise_cents), resolution) for setup, hertz in exact.items()
        }
        if all(_are_apart(list(hertz.values()), resolution) for hertz in readings.values()):
            truth = Truth(true, drawn, sizes, noise_cents, levels)
            return PlantedBoard(name, design, truth, readings, exact, n_draws, sensor, noise_factor, resolution)
    raise RuntimeError(f"{design.name} with {', '.join(effects)}: wanted a board with clear labels, got none")


def _noise_levels(rng: np.random.Generator, design: Design, median: float, factor: float) -> dict[str, float]:
    """Noise of each setup, cents, drawn from the log-normal prior of a card."""
    return {setup.name: median * factor ** float(rng.standard_normal()) for setup in design.setups}


def _read(
    rng: np.random.Generator, hertz: Mapping[Label, float], noise_cents: float, resolution: float
) -> dict[Label, float]:
    """Frequencies with relative normal noise, rounded to a resolution (Hz) unless that is 0."""
    noisy = {label: hz * 2.0 ** (noise_cents * float(rng.standard_normal()) / 1200.0) for label, hz in hertz.items()}
    return {label: resolution * round(hz / resolution) for label, hz in noisy.items()} if resolution else noisy


def _are_apart(hertz: Sequence[float], resolution: float) -> bool:
    """Whether no two rounded readings show the same figure; readings that are not rounded never do."""
    return not resolution or len(hertz) < 2 or float(np.diff(np.sort(hertz)).min()) > 0.5 * resolution


def _frequencies(
    design: Design, constants: Mapping[str, float], drawn: Mapping[str, Mapping[str, Any]]
) -> tuple[dict[str, dict[Label, float]], float]:
    """Frequencies by setup and laboratory's label, and the smallest correlation with a beam product."""
    hertz: dict[str, dict[Label, float]] = {}
    least = 1.0
    for setup in design.setups:
        acting = [RECIPES[e].make(dict(values)) for e, values in drawn.items() if RECIPES[e].acts(setup)]
        found, correlation = frequencies(design.plate(setup, constants), acting, setup.beams)
        hertz[setup.name] = {setup.label(beams): value for beams, value in found.items()}
        least = min(least, correlation)
        if least < LEAST_CORRELATION:
            break
    return hertz, least


def _draw_constants(rng: np.random.Generator) -> dict[str, float]:
    drawn = {name: float(m * np.exp(np.log(f) * rng.standard_normal())) for name, (m, f) in MEDIANS.items()}
    return {**drawn, "nu_xy": POISSON}


def _refuse_wrong(planted: Sequence[str], design: Design) -> None:
    for effect in planted:
        if effect not in RECIPES:
            raise ValueError(f"effects: wanted one of {', '.join(RECIPES)}, got {effect}")
        if not any(RECIPES[effect].acts(setup) for setup in design.setups):
            raise ValueError(f"effects: wanted one that acts on {design.name}, got {effect}")
