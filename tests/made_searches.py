"""Searches made by hand: baselines of random slopes and tables of random shifts, without any plate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from made_boards import setup_of

from bayesplate.board.board import make_board
from bayesplate.board.parameter import BOARD_OWNER, Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Reading
from bayesplate.board.setup import Setup
from bayesplate.diagnosis.baseline import Baseline, PossibleModes
from bayesplate.diagnosis.forms import Form
from bayesplate.diagnosis.hypotheses import RELABELLING, Hypothesis, Swap
from bayesplate.diagnosis.laws import FormLaw
from bayesplate.diagnosis.null_control import NullControl
from bayesplate.diagnosis.search import Candidate, SearchGround, SearchResult
from bayesplate.diagnosis.shifts import Cells, combine_cells, no_effect_cells
from bayesplate.diagnosis.signatures import signature
from bayesplate.diagnosis.terms import NoiseGrid, noise_grid
from bayesplate.diagnosis.verdict import Verdict, decide_verdict
from bayesplate.frequencies.laws import cents
from bayesplate.labels import Label
from bayesplate.plate.naming import ModePlace

FREE = {"x0": "free", "x1": "free", "y0": "free", "y1": "free"}
NOISE = 0.005
LOG_RIGIDITIES = np.log([30.0, 2.0, 5.0])


def baseline(
    rng: np.random.Generator,
    n_modes: int = 6,
    *,
    resolution: float = 0.0,
    n_inputs: int = 0,
    noise: Sequence[float] = (NOISE,),
    parities: Sequence[tuple[int, int]] = (),
    spacing: float = 0.3,
) -> Baseline:
    """Random slopes whose rows sum to one half, as a bare plate's do; as many setups as noises."""
    hertz = 60.0 * np.exp(spacing * np.arange(n_modes))
    parts = np.array_split(np.arange(n_modes), len(noise))
    setups = tuple(
        setup_of(
            FREE,
            {(int(i), 0): float(hertz[i]) for i in part},
            name=f"setup-{k}",
            resolution=resolution,
            noise=Quantity.from_median(level, np.exp(0.5)),
        )
        for k, (part, level) in enumerate(zip(parts, noise, strict=True))
    )
    shares = rng.dirichlet(np.full(3, 0.7), size=n_modes)
    inputs = {"thickness": Quantity.exact(3e-3), "poisson_xy": Quantity.exact(0.4)}
    places = tuple(ModePlace(parity, 0, 1.0) for parity in parities or [(0, 0)] * n_modes)
    log_frequency, slopes = np.log(hertz), 0.5 * shares
    return Baseline(
        board=make_board("made", inputs, setups),
        values={name: np.asarray(v) for name, v in {"D_x": 30.0, "D_y": 2.0, "D_s": 5.0}.items()}
        | {name: np.asarray(q.mean) for name, q in inputs.items()},
        log_rigidities=LOG_RIGIDITIES,
        log_readings=log_frequency,
        possible_modes=PossibleModes(
            log_frequency=log_frequency,
            slopes=slopes,
            input_slopes=0.01 * rng.standard_normal((n_modes, n_inputs)),
            places=tuple(tuple(places[i] for i in part) for part in parts),
            inputs=np.zeros(n_inputs),
            peaks=(None,) * len(noise),
            predict=lambda x: log_frequency + (x - LOG_RIGIDITIES) @ slopes.T,
        ),
        rows=np.arange(n_modes),
        symmetry=tuple((True, True) for _ in noise),
    )


def with_residual(base: Baseline, residual: np.ndarray) -> Baseline:
    """The same baseline with other readings."""
    return replace(base, log_readings=base.middle + np.asarray(residual))


def with_modes(base: Baseline, **changed: object) -> Baseline:
    """The same baseline with other slopes, frequencies or laws of its modes, and the readings that it had."""
    return replace(base, possible_modes=replace(base.possible_modes, **changed))


def exchanged(base: Baseline, swap: Swap, residuals: np.ndarray) -> np.ndarray:
    """Residuals, (n_sets, n_modes) array, of readings of which two have each other's labels."""
    readings = residuals + base.middle
    readings[:, [swap.first, swap.second]] = readings[:, [swap.second, swap.first]]
    return readings - base.middle


def table(
    rng: np.random.Generator, n_modes: int = 6, n_cells: int = 3, n_tangents: int = 1, *, size: float = 0.01
) -> Cells:
    """Cells with random shifts and tangents."""
    weights = rng.dirichlet(np.full(n_cells, 3.0))
    return Cells(
        weights=weights,
        shift=size * rng.standard_normal((n_cells, n_modes)),
        slopes=0.5 * size * rng.standard_normal((n_cells, n_modes, n_tangents)),
        moved=size * rng.standard_normal((n_cells, 3)),
        moved_slopes=0.5 * size * rng.standard_normal((n_cells, 3, n_tangents)),
        form=np.zeros(n_cells, dtype=np.intp),
        z=np.zeros((n_cells, max(n_tangents, 1))),
        z_slopes=np.zeros((n_cells, max(n_tangents, 1))),
    )


def one_level(base: Baseline, noise: float = NOISE) -> NoiseGrid:
    """A noise that is known."""
    return NoiseGrid(np.full((1, len(base.board.setups)), noise), np.ones(1))


def ground_of(base: Baseline, *found: Hypothesis, candidates: Mapping[str, Candidate] | None = None) -> SearchGround:
    """A search ground of given hypotheses."""
    return SearchGround(base, candidates or {}, found)


def bare(base: Baseline, noise: NoiseGrid, prior: float = 0.5) -> Hypothesis:
    """The hypothesis that nothing is lacking."""
    return Hypothesis((), prior, no_effect_cells(base.n_modes), noise, base)


def singles(
    base: Baseline, effects: Mapping[str, Candidate], levels: NoiseGrid | None = None, prior: float = 0.1
) -> list[Hypothesis]:
    """The hypotheses of no effect, and of each effect alone."""
    levels = noise_grid(base.board) if levels is None else levels
    return [bare(base, levels), *(Hypothesis((name,), prior, one.fine, levels, base) for name, one in effects.items())]


def found_among(
    base: Baseline,
    effects: Mapping[str, Candidate],
    hypotheses: Sequence[Hypothesis],
    probability: Sequence[float],
    residual: np.ndarray,
) -> SearchResult:
    """A search that found given probabilities of its hypotheses."""
    shares = np.asarray(probability)
    return SearchResult(ground_of(base, *hypotheses, candidates=effects), residual, np.log(shares + 1e-300), shares)


def left_out(ground: SearchGround, index: int, residual: np.ndarray) -> np.ndarray:
    """Errors of predicting each reading from the other modes under one hypothesis: (n_modes,) array, ln f."""
    one = ground.hypotheses[index]
    return one.terms.left_out(one.residual_under_labels(ground.baseline, residual[None, :]))[1][:, 0]


def visible_of(one: Candidate) -> np.ndarray:
    """Visible shift of a candidate at its nominal size: (n_modes,) array, ln f."""
    return one.signature.visible / float(cents(np.ones(1))[0])


HALF_NORMAL = Quantity.from_mean(0.0, 1.0, "normal", lower=0.0)


def candidate(
    base: Baseline,
    name: str,
    direction: np.ndarray,
    prior: Quantity = HALF_NORMAL,
    n_cells: int = 33,
    n_coarse: int = 9,
) -> Candidate:
    """An effect whose shift is a direction times its size, one parameter with a given prior."""
    free = Parameter("size", BOARD_OWNER, prior, "1", 0.0, effect=name)
    law = MadeLaw(Form(name, "", base.board, (free,)), (), direction=direction)
    fine, coarse = (_along(base, direction, prior, n) for n in (n_cells, n_coarse))
    shift = direction * float(prior.value(1.0))
    seen = signature(base, name, (free,), base.log_frequency + shift)
    return Candidate(name, (law,), fine, coarse, seen, float(np.linalg.norm(seen.visible / cents(base.scales))))


def found_with(
    probability: Mapping[tuple[str, ...], float],
    names: Sequence[str] = ("a", "b", "c"),
    *,
    n_modes: int = 6,
    size: float = 0.05,
    prior: Quantity = HALF_NORMAL,
    residual: np.ndarray | None = None,
) -> SearchResult:
    """A search of three effects, of an exchange of two labels, and of the first two effects together, in this order.

    It found given probabilities by members. By default the readings are those of the first effect at its nominal size.
    """
    base = baseline(np.random.default_rng(1), n_modes)
    directions = size * np.linalg.qr(np.random.default_rng(2).standard_normal((n_modes, n_modes)))[0][: len(names)]
    effects = {name: candidate(base, name, one, prior) for name, one in zip(names, directions, strict=True)}
    first, second, *_ = effects.values()
    every, swap = singles(base, effects), Swap(1, 2)
    levels, both = every[0].noise, combine_cells(first.coarse, second.coarse)
    every += [Hypothesis((RELABELLING,), 0.1, no_effect_cells(n_modes), levels, swap.applied(base), swap)]
    every += [Hypothesis((first.name, second.name), 0.1, both, levels, base)]
    residual = visible_of(first) if residual is None else residual
    return found_among(base, effects, every, [probability.get(one.members, 0.0) for one in every], residual)


QUIET = np.zeros(6)
"""Residual of six readings without any noise."""
BEYOND_NOISE = 0.3 * np.log(60.0 * np.exp(0.3 * np.arange(6))) * np.array([1, -1, 1, 1, -1, -1])
"""That of six readings that neither noise nor any effect explains."""


@dataclass(frozen=True, eq=False)
class MadeLaw(FormLaw):
    """An effect that adds a direction times its size."""

    direction: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def mode_log_frequencies(self, baseline, log_rigidities, values):
        (size,) = values.values()
        return baseline.possible_modes.predict(log_rigidities) + np.outer(size, self.direction)


def _along(base: Baseline, direction: np.ndarray, prior: Quantity, n: int) -> Cells:
    low, high = (float(np.clip(prior.standard(bound), -3.0, 3.0)) for bound in (prior.lower, prior.upper))
    width = (high - low) / n
    z = low + width * (np.arange(n) + 0.5)
    weights = np.exp(prior.log_prior(z))
    moved = -np.outer(prior.value(z), base.absorption @ direction)
    slope = prior.value(z + 0.25 * width) - prior.value(z - 0.25 * width)
    return Cells(
        weights=weights / weights.sum(),
        shift=np.outer(prior.value(z), direction) + moved @ base.slopes.T,
        slopes=(slope[:, None] * (direction - base.slopes @ (base.absorption @ direction)))[:, :, None],
        moved=moved,
        moved_slopes=-(slope[:, None] * (base.absorption @ direction))[:, :, None],
        form=np.zeros(n, dtype=np.intp),
        z=z[:, None],
        z_slopes=np.full((n, 1), 0.5 * width),
    )


def with_readings(base: Baseline, *, labels: Sequence[tuple[int, int]]) -> Baseline:
    """The same baseline with other labels in its only setup."""
    (setup,) = base.board.setups
    readings: tuple[Reading, ...] = tuple(
        replace(one, label=Label(*label)) for one, label in zip(setup.readings, labels, strict=True)
    )
    changed: Setup = replace(setup, readings=readings)
    return replace(base, board=replace(base.board, setups=(changed,)))


CERTAIN = NullControl(log_odds=np.full(100, 50.0), ratio=np.full(100, 0.9))
"""A null control that leaves so much to chance that only certainty calls for an effect, as a probability below 0.1."""


def decided(
    found: SearchResult, control: NullControl = CERTAIN, others: Sequence[tuple[str, SearchResult]] = ()
) -> Verdict:
    """The verdict by the given probabilities alone, which need not be those of the readings."""
    return decide_verdict(found, control, others)
