"""Boards with planted effects: constants drawn around spruce, effects of a size, noise, and a card to read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from generator.card import NOISE_FACTOR, NOTHING, card_text
from generator.designs import DESIGNS, MEDIANS, POISSON, STEEL_DESIGNS, STEEL_MEDIANS, STEEL_POISSON, Design
from generator.naming import LEAST_CORRELATION, Label, frequencies
from generator.recipes import KNOWN_SIZE, LIBRARY, OF_WOOD, RECIPES

MOST_DRAWS = 200
KINDS = {"none": 0.25, "one": 0.5, "two": 0.125, "outside": 0.125}
"""Shares of boards without effect, with one, with two, and with one that no library knows."""


@dataclass(frozen=True)
class Truth:
    """What is true of a planted board.

    Attributes
    ----------
    constants : dict
        E_x, E_y, G_xy, Pa, and nu_xy as tabulated (a planted poisson_ratio replaces it), or drawn if isotropic.
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

    @property
    def is_in_library(self) -> bool:
        """Whether the package knows every planted effect by name."""
        return all(name in LIBRARY for name in self.effects)


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
    places_known : bool
        Whether the card says where the attached mass, or the exciter, sits.
    prior : str
        Prior card named in the card.
    sensor : (float, float) or None, m
        Place of a sensor that the card mentions, without its mass, whether or not it weighs anything.
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
    places_known: bool = True
    prior: str = ""
    sensor: tuple[float, float] | None = None
    noise_factor: float = NOISE_FACTOR
    resolution: float = 0.0

    def card_text(self, stated: Mapping[str, str] = NOTHING) -> str:
        """The board card, which tells nothing of the truth but the noise and the places of what is attached.

        Unless it is told more: see `generator.card.card_text`.
        """
        places, driven = (
            self.truth.effects.get(effect, {}).get("places", ()) if self.places_known else ()
            for effect in ("attached_mass", "exciter")
        )
        places = places if self.sensor is None else (self.sensor,)
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
            prior=self.prior,
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
    effects: Sequence[str] | None = None,
    size: float | None = 1.0,
    noise_cents: float | None = 5.0,
    *,
    name: str = "planted",
    scale_known: bool = False,
    n_places: int = 1,
    places_known: bool = True,
    prior: str = "",
    fixed: Mapping[str, Mapping[str, Any]] | None = None,
    sensor: tuple[float, float] | None = None,
    noise_factor: float = NOISE_FACTOR,
    constants: Mapping[str, float] | None = None,
    noise_is_drawn: bool = False,
    resolution: float = 0.0,
) -> PlantedBoard:
    """Simulate a board.

    Parameters
    ----------
    rng : numpy.random.Generator
    design : Design or str
        One of `DESIGNS` or `STEEL_DESIGNS`.
    effects : sequence of str, optional
        Names to plant, of the library or outside it; empty for an ideal board. None draws none, one, two, or one
        outside the library, with the shares `KINDS`.
    size : float, optional
        Multiple of the design's nominal sizes; None draws it from 1/2 to 2, log-uniform, for each effect.
    noise_cents : float, optional
        Standard deviation of the noise of a reading; None draws it from 2 to 17, log-uniform.
    name : str
        Of the card.
    scale_known : bool
        Whether size acts on the air and the shear compliance too, beyond what is physical.
    n_places : int
        Places over which an attached mass, or an exciter, roves.
    places_known : bool
        Whether the card states the place of a planted mass or exciter.
    prior : str
        Prior card named in the card; empty: the package's default.
    fixed : mapping, optional
        Effect -> parameters that are not drawn, SI units.
    sensor : (float, float), optional, m
        Place on the whole board of a sensor that the card mentions in any case; a planted mass sits there.
    noise_factor : float
        Of the noise prior on the card, whose median is the true noise unless that is drawn.
    constants : mapping, optional
        E_x, E_y, G_xy, Pa, if they are not to be drawn; nu_xy is the tabulated one unless it is given too.
    noise_is_drawn : bool
        Whether the true noise of each setup is drawn from the prior on the card, whose median is `noise_cents`.
    resolution : float, Hz
        Readings are rounded to this, and the card says so; 0: neither. Readings of one setup that would come closer to
        each other than this are drawn again, as a laboratory could not tell such modes apart.

    Returns
    -------
    PlantedBoard

    Raises
    ------
    ValueError
        If an effect is unknown, or acts in no setup of the design.
    RuntimeError
        If no board with labels beyond doubt was found in `MOST_DRAWS` draws.
    """
    design = (DESIGNS | STEEL_DESIGNS)[design] if isinstance(design, str) else design
    planted = _choose(rng, design) if effects is None else tuple(effects)
    _refuse_wrong(planted, design)
    noise = _log_uniform(rng, 2.0, 17.0) if noise_cents is None else noise_cents
    settled = {effect: dict(values) for effect, values in (fixed or {}).items()}
    if sensor is not None:
        settled.setdefault("attached_mass", {})["places"] = (sensor,)
    for n_draws in range(1, MOST_DRAWS + 1):
        true = _draw_constants(rng, design) if constants is None else {"nu_xy": POISSON, **constants}
        sizes = {effect: _size(rng, effect, size, scale_known) for effect in planted}
        drawn = {effect: RECIPES[effect].draw(rng, design, sizes[effect]) for effect in planted}
        for effect in ("attached_mass", "exciter"):
            if n_places > 1 and effect in drawn:
                more = [RECIPES[effect].draw(rng, design, 1.0)["places"][0] for _ in range(n_places - 1)]
                drawn[effect]["places"] += tuple(more)
        drawn = {effect: values | settled.get(effect, {}) for effect, values in drawn.items()}
        exact, correlation = _frequencies(design, true, drawn)
        if correlation < LEAST_CORRELATION:
            continue
        levels = _noise_levels(rng, design, noise, noise_factor) if noise_is_drawn else {}
        readings = {setup: _read(rng, hertz, levels.get(setup, noise), resolution) for setup, hertz in exact.items()}
        if all(_are_apart(list(hertz.values()), resolution) for hertz in readings.values()):
            truth = Truth(true, drawn, sizes, noise, levels)
            return PlantedBoard(
                name, design, truth, readings, exact, n_draws, places_known, prior, sensor, noise_factor, resolution
            )
    raise RuntimeError(f"{design.name} with {', '.join(planted)}: wanted a board with clear labels, got none")


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
        acting += setup.surroundings
        found, correlation = frequencies(design.plate(setup, constants), acting, setup.beams)
        hertz[setup.name] = {setup.label(beams): value for beams, value in found.items()}
        least = min(least, correlation)
        if least < LEAST_CORRELATION:
            break
    return hertz, least


def _draw_constants(rng: np.random.Generator, design: Design) -> dict[str, float]:
    if design.isotropic:
        (median, factor), (mean, sd) = STEEL_MEDIANS["E_x"], STEEL_POISSON
        modulus = float(median * np.exp(np.log(factor) * rng.standard_normal()))
        nu = float(mean + sd * rng.standard_normal())
        return {"E_x": modulus, "E_y": modulus, "G_xy": 0.5 * modulus / (1.0 + nu), "nu_xy": nu}
    drawn = {name: float(m * np.exp(np.log(f) * rng.standard_normal())) for name, (m, f) in MEDIANS.items()}
    return {**drawn, "nu_xy": POISSON}


def _choose(rng: np.random.Generator, design: Design) -> tuple[str, ...]:
    kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    if kind == "outside":
        return (str(rng.choice(design.drawn_outside)),)
    n = {"none": 0, "one": 1, "two": 2}[kind]
    return tuple(str(effect) for effect in rng.choice(design.drawn, size=n, replace=False))


def _size(rng: np.random.Generator, effect: str, size: float | None, scale_known: bool) -> float:
    wanted = _log_uniform(rng, 0.5, 2.0) if size is None else size
    return wanted if scale_known or effect not in KNOWN_SIZE else 1.0


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _refuse_wrong(planted: Sequence[str], design: Design) -> None:
    for effect in planted:
        if effect not in RECIPES:
            raise ValueError(f"effects: wanted one of {', '.join(RECIPES)}, got {effect}")
        of_wood = design.isotropic and effect in OF_WOOD
        if of_wood or not any(RECIPES[effect].acts(setup) for setup in design.setups):
            raise ValueError(f"effects: wanted one that acts on {design.name}, got {effect}")
