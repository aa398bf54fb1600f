"""Beliefs about one board or several: normal terms of constants, inputs and shared parameters.

Every reading, taken or not, is linear in the columns of u: the logarithms of each board's free rigidities, the standard
coordinates of its uncertain inputs, of the parameters that boards share, and of the sizes of an effect within a cell of
its table. Given the readings at hand u is normal; where effects or noise are in doubt, a mixture of such terms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI, RIGIDITIES, moduli_of
from bayesplate.board.parameter import Parameter
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.frequencies.prior_bands import prior_medians, with_rigidities
from bayesplate.planning.laws import BareLaw, bare_law
from bayesplate.planning.stations import new_stations, old_stations
from bayesplate.posterior.parameters import Parameters

N_TERMS = 96
"""Equally weighted terms that stand for an explanation."""
NO_EFFECT = "no effect"
_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class FormTerms:
    """Terms of an explanation in which its effects have the same forms."""

    rows: Indices  # (n,) array of int: indices of the terms
    board: Board  # with the forms declared
    effects: tuple[str, ...]  # the effect of each parameter
    parameters: tuple[Parameter, ...]  # the uncertain sizes
    columns: Indices  # (n_parameters,) array of int: columns of u that are their standard coordinates


@dataclass(frozen=True, eq=False)
class ReadingsAtHand:
    """The readings at hand as an explanation expects them, setup by setup: the peaks stay, whatever their labels."""

    shift: Floats  # (n_terms, n_readings) array: ln f (Hz) where u is zero; NaN of a reading that is no mode
    slopes: Floats  # (n_terms, n_readings, n_u) array
    # (n_readings,) array of int: the reading that has each label under the explanation; -1 for none
    reading_index: Indices


@dataclass(frozen=True, eq=False)
class ExplanationTerms:
    """An explanation of the readings, as equally probable normal terms of u."""

    members: tuple[str, ...]  # effects that are present; empty for none
    words: str
    probability: float  # among the surviving explanations; they sum to one
    mean: Floats  # (n_terms, n_u) array
    covariance: Floats  # (n_terms, n_u, n_u) array
    noise: Floats  # (n_terms, n_setups) array: relative, of the setups of all boards in turn
    # (n_terms, n_targets) array: standard coordinates of the shared parameters, then ln of E_x, E_y, G_xy (Pa), board
    # after board; where u is zero
    middle: Floats
    target_slopes: Floats  # (n_terms, n_targets, n_u) array: their slopes
    forms: tuple[FormTerms, ...] = ()
    # the expected readings at hand; by default those of the laws of the stations
    readings_at_hand: ReadingsAtHand | None = None

    @property
    def n_terms(self) -> int:
        return len(self.mean)

    @property
    def expected(self) -> Floats:
        """Mean of the target quantities in each term: (n_terms, n_targets) array."""
        return np.asarray(self.middle + np.einsum("twu,tu->tw", self.target_slopes, self.mean))


@dataclass(frozen=True, eq=False)
class KnownBoard:
    """A board with its computed modes."""

    board: Board
    values: Values  # rigidities and inputs about which its modes are computed, SI
    laws: tuple[BareLaw, ...]  # of its stations
    columns: Floats  # (n_fitted, n_u) array: derivatives of its constants and inputs by the columns of u
    first_setup: int = 0  # index of its first setup among those of all boards
    # (n_shared, n_shared) array: its precision of the shared parameters, its own parameters integrated out
    shared_precision: Floats | None = None


@dataclass(frozen=True, eq=False)
class Beliefs:
    """The present beliefs about one board, or about several together."""

    boards: tuple[KnownBoard, ...]
    explanations: tuple[ExplanationTerms, ...]  # the most probable first
    shared: tuple[str, ...] = ()  # names of the parameters that the boards share
    # their source: "readings", "prior" (readings, if there are any, are not used) or "campaign"
    basis: str = "readings"
    notes: tuple[str, ...] = ()  # limits of a plan that rests on them
    # where nothing explains the readings, what to do about a wrong reading before anything else
    wrong_reading: str | None = None

    @property
    def is_prior(self) -> bool:
        return self.basis == "prior"

    @property
    def probabilities(self) -> Floats:
        return np.array([explanation.probability for explanation in self.explanations])

    @property
    def entropy(self) -> float:
        return float(entropy(self.probabilities[:, None])[0])

    @property
    def counted_targets(self) -> list[int]:
        """Indices of the target quantities whose information is counted: the shared ones, or else the free moduli.

        The moduli of an isotropic board follow from its first one.
        """
        n, numbered_boards = len(MODULI), enumerate(self.boards)
        return list(range(len(self.shared))) or [
            n * i + j for i, known_board in numbered_boards for j in range(known_board.board.symmetry.n)
        ]


def entropy(probabilities: Floats) -> Floats:
    """Entropy of the explanations, nats: (n_draws,) array from (n_explanations, n_draws)."""
    from scipy.special import entr

    return np.asarray(entr(probabilities).sum(axis=0))


def station_laws(
    board: Board, values: Values, prior: PriorCard | None, plates: Sequence[Values] = (), *, is_elsewhere: bool = True
) -> tuple[BareLaw, ...]:
    """The laws of a board's old stations and, if `is_elsewhere`, of its new ones; see `bare_law`."""
    stations = [*old_stations(board, values), *(new_stations(board, values, prior) if is_elsewhere else ())]
    return tuple(bare_law(board, station, values, plates) for station in stations)


def prior_levels(prior: Quantity, n: int, rng: np.random.Generator) -> Floats:
    """Values of a prior at equally probable levels, in random order: (n,) array."""
    from scipy.special import ndtri

    return np.asarray(prior.value(rng.permutation(ndtri((np.arange(n) + 0.5) / n))))


def log_moduli(board: Board, log_rigidities: Floats) -> tuple[Floats, Floats]:
    """ln E_x, E_y, G_xy (Pa) at the middle of the inputs' priors: (3,) array, and slopes, (3, n_fitted) array."""
    parameters = Parameters(board)
    columns = parameters.fitted_columns
    theta = np.zeros((1 + 2 * columns.size, parameters.n_dim))
    theta[:, : parameters.n_constants] = log_rigidities
    theta[1 : 1 + columns.size, columns] += _STEP * np.eye(columns.size)
    theta[1 + columns.size :, columns] -= _STEP * np.eye(columns.size)
    values = parameters.values(theta)
    logs = np.stack([np.log(np.broadcast_to(constant, len(theta))) for constant in moduli_of(values)])
    middle, above, below = np.split(logs, [1, 1 + columns.size], axis=1)
    return middle[:, 0], (above - below) / (2.0 * _STEP)


_N_PLATES = 12
"""Plates drawn from the prior at which the slopes of the frequencies are taken."""


def prior_beliefs(board: Board, prior: PriorCard, rng: np.random.Generator, notes: tuple[str, ...] = ()) -> Beliefs:
    """The beliefs of the prior about a board; the notes say why its readings, if there are any, are not used.

    Its frequencies are not linear over a prior that wide, so that the slopes are taken at plates drawn from it.
    """
    values, explanation = prior_medians(board, prior), prior_explanation(board, prior, rng)
    laws = station_laws(board, values, prior, _draw_plates(prior, values, rng))
    known_board = KnownBoard(board, values, laws, np.eye(explanation.mean.shape[1]))
    return Beliefs((known_board,), (explanation,), basis="prior", notes=(*notes, *board.notes))


def prior_explanation(board: Board, prior: PriorCard, rng: np.random.Generator) -> ExplanationTerms:
    """The prior of a board as the explanation without an effect, normal in the logarithms of its constants."""
    values, n, n_u = prior_medians(board, prior), board.symmetry.n, Parameters(board).fitted_columns.size
    middle, gradient = log_moduli(board, np.log(board.symmetry.free_of(values)))
    names = tuple(prior.constants)
    is_of_moduli = set(names) <= set(MODULI)
    order = [names.index(name) for name in (MODULI if is_of_moduli else RIGIDITIES) if name in names]
    # The stated constants are independent of the inputs; rigidities follow from moduli, thickness and Poisson ratio.
    to_stated = np.eye(n, n_u)
    if is_of_moduli:
        to_stated = gradient[[MODULI.index(names[i]) for i in order]]
    design = np.vstack([to_stated, np.eye(n_u)[n:]])
    spread = np.r_[[prior.constants[names[i]].log_sd for i in order], np.ones(n_u - n)]
    root = np.linalg.solve(design, np.diag(spread))
    return ExplanationTerms(
        members=(),
        words=NO_EFFECT,
        probability=1.0,
        mean=np.zeros((N_TERMS, n_u)),
        covariance=np.tile(root @ root.T, (N_TERMS, 1, 1)),
        noise=np.stack([prior_levels(setup.noise, N_TERMS, rng) for setup in board.setups], axis=1),
        middle=np.tile(middle, (N_TERMS, 1)),
        target_slopes=np.tile(gradient, (N_TERMS, 1, 1)),
    )


def _draw_plates(prior: PriorCard, values: Values, rng: np.random.Generator) -> list[Mapping[str, Floats]]:
    """Plates drawn from the prior, without those of no possible material, nu_xy nu_yx >= 1."""
    plain = {name: value for name, value in values.items() if name not in (*MODULI, *RIGIDITIES)}
    drawn = {name: quantity.sample(rng, _N_PLATES) for name, quantity in prior.constants.items()}
    draws = ({name: np.asarray(samples[i]) for name, samples in drawn.items()} for i in range(_N_PLATES))
    plates = [with_rigidities({**plain, **constants}) for constants in draws]
    return [plate for plate in plates if all(np.isfinite(plate[name]) for name in RIGIDITIES)]
