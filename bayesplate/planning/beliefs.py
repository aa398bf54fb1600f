"""What is believed now: of one board or of several, as normal terms of constants, inputs and what boards share.

Every reading, taken or not, is linear in the columns of u: the logarithms of each board's free rigidities, the standard
coordinates of its uncertain inputs, of the numbers that boards share, and of the sizes of an effect within a cell of
its table. Given the readings at hand u is normal; where effects or noise are in doubt, a mixture of such terms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI, RIGIDITIES, moduli
from bayesplate.board.parameter import Parameter
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.frequencies.prior_bands import prior_medians, with_rigidities
from bayesplate.planning.laws import BareLaw, bare_law
from bayesplate.planning.stations import new_stations, old_stations
from bayesplate.posterior.parameters import Parameters

Rows = NDArray[np.intp]

N_TERMS = 96
"""Equally weighted terms that stand for an explanation."""
NOTHING_LACKS = "no effect"
_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class FormTerms:
    """Terms of an explanation in which its effects have the same forms."""

    rows: Rows  # (n,) array of int: which terms
    board: Board  # with the forms declared
    effects: tuple[str, ...]  # one per parameter
    parameters: tuple[Parameter, ...]  # the sizes that are uncertain
    columns: Rows  # (n_parameters,) array of int: columns of u that are their standard coordinates


@dataclass(frozen=True, eq=False)
class AtHand:
    """What an explanation expects of the readings at hand, setup by setup: the peaks stay, whatever their names."""

    shift: Floats  # (n_terms, n_readings) array: ln f (Hz) where u is zero; not a number of a reading that is no mode
    slopes: Floats  # (n_terms, n_readings, n_u) array
    taken: Rows  # (n_readings,) array of int: the reading by whose label each of them goes then; -1 for none


@dataclass(frozen=True, eq=False)
class Belief:
    """One thing that may be the case, as equally probable normal terms of u."""

    members: tuple[str, ...]  # effects that are present; empty for none
    words: str
    probability: float  # among the explanations that survive; they sum to one
    mean: Floats  # (n_terms, n_u) array
    covariance: Floats  # (n_terms, n_u, n_u) array
    noise: Floats  # (n_terms, n_setups) array: relative, of the setups of all boards in turn
    # (n_terms, n_wanted) array: standard coordinates of what boards share, then ln of E_x, E_y, G_xy (Pa), board after
    # board; where u is zero
    middle: Floats
    wanted: Floats  # (n_terms, n_wanted, n_u) array: their slopes
    forms: tuple[FormTerms, ...] = ()
    # what is expected of the readings at hand; by default what the laws of the stations say
    again: AtHand | None = None

    @property
    def n_terms(self) -> int:
        return len(self.mean)

    @property
    def expected(self) -> Floats:
        """Mean of what is wanted in each term: (n_terms, n_wanted) array."""
        return np.asarray(self.middle + np.einsum("twu,tu->tw", self.wanted, self.mean))


@dataclass(frozen=True, eq=False)
class KnownBoard:
    """A board of a belief."""

    board: Board
    values: Values  # rigidities and inputs about which its modes are computed, SI
    laws: tuple[BareLaw, ...]  # of the stations that are looked at
    columns: Floats  # (n_fitted, n_u) array: what the columns of u do to its constants and inputs
    first_setup: int = 0  # where its setups begin among those of all boards
    # (n_shared, n_shared) array: precision of what it says of the shared parameters, its own integrated out
    pull: Floats | None = None


@dataclass(frozen=True, eq=False)
class Beliefs:
    """What is believed now of one board, or of several together."""

    boards: tuple[KnownBoard, ...]
    explanations: tuple[Belief, ...]  # the most probable first
    shared: tuple[str, ...] = ()  # names of what the boards share
    # what is believed: "readings", "prior" (readings, if there are any, were left aside) or "campaign"
    basis: str = "readings"
    notes: tuple[str, ...] = ()  # what a plan that rests on it does not know
    # where nothing explains the readings, what is to be done about a wrong one before anything else
    wrong: str | None = None

    @property
    def is_prior(self) -> bool:
        return self.basis == "prior"

    @property
    def probabilities(self) -> Floats:
        return np.array([one.probability for one in self.explanations])

    @property
    def entropy(self) -> float:
        return float(entropy(self.probabilities[:, None])[0])

    @property
    def free(self) -> list[int]:
        """Which of the wanted numbers the information is counted of: the shared ones, or else the free moduli.

        The moduli of an isotropic board follow from its first one.
        """
        n, many = len(MODULI), enumerate(self.boards)
        return list(range(len(self.shared))) or [n * i + j for i, one in many for j in range(one.board.symmetry.n)]


def entropy(probabilities: Floats) -> Floats:
    """Of explanations, nats: (n_draws,) array from (n_explanations, n_draws)."""
    from scipy.special import entr

    return np.asarray(entr(probabilities).sum(axis=0))


def laws_of(
    board: Board, values: Values, prior: PriorCard | None, drawn: Sequence[Values] = (), *, is_elsewhere: bool = True
) -> tuple[BareLaw, ...]:
    """The modes of a board as it was held and, if asked for, as it never was; see `bare_law`."""
    ways = [*old_stations(board, values), *(new_stations(board, values, prior) if is_elsewhere else ())]
    return tuple(bare_law(board, one, values, drawn) for one in ways)


def levels(prior: Quantity, n: int, rng: np.random.Generator) -> Floats:
    """Values of a prior at equally probable levels, in random order: (n,) array."""
    from scipy.special import ndtri

    return np.asarray(prior.value(rng.permutation(ndtri((np.arange(n) + 0.5) / n))))


def log_moduli(board: Board, log_rigidities: Floats) -> tuple[Floats, Floats]:
    """ln E_x, E_y, G_xy (Pa), the inputs at the middle of their priors: (3,) array, and slopes, (3, n_fitted) array."""
    parameters = Parameters(board)
    columns = parameters.fitted_columns
    theta = np.zeros((1 + 2 * columns.size, parameters.n_dim))
    theta[:, : parameters.n_constants] = log_rigidities
    theta[1 : 1 + columns.size, columns] += _STEP * np.eye(columns.size)
    theta[1 + columns.size :, columns] -= _STEP * np.eye(columns.size)
    values = parameters.values(theta)
    D_x, D_y, D_s = (values[name] for name in RIGIDITIES)
    found = moduli(D_x, D_y, D_s, values["thickness"], values["poisson_xy"])
    logs = np.stack([np.log(np.broadcast_to(one, len(theta))) for one in found])
    middle, above, below = np.split(logs, [1, 1 + columns.size], axis=1)
    return middle[:, 0], (above - below) / (2.0 * _STEP)


_N_PLATES = 12
"""Plates drawn from the prior at which the slopes of the frequencies are taken."""


def prior_beliefs(board: Board, prior: PriorCard, rng: np.random.Generator, notes: tuple[str, ...] = ()) -> Beliefs:
    """What the prior believes of a board; the notes say why its readings, if there are any, were left aside.

    Its frequencies are not linear over a prior that wide, so that the slopes are taken at plates drawn from it.
    """
    values, one = prior_medians(board, prior), prior_explanation(board, prior, rng)
    laws = laws_of(board, values, prior, _plates(prior, values, rng))
    known = KnownBoard(board, values, laws, np.eye(one.mean.shape[1]))
    return Beliefs((known,), (one,), basis="prior", notes=(*notes, *board.notes))


def prior_explanation(board: Board, prior: PriorCard, rng: np.random.Generator) -> Belief:
    """What the prior says of a board, normal in the logarithms of its constants: no effect is thought of."""
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
    return Belief(
        members=(),
        words=NOTHING_LACKS,
        probability=1.0,
        mean=np.zeros((N_TERMS, n_u)),
        covariance=np.tile(root @ root.T, (N_TERMS, 1, 1)),
        noise=np.stack([levels(setup.noise, N_TERMS, rng) for setup in board.setups], axis=1),
        middle=np.tile(middle, (N_TERMS, 1)),
        wanted=np.tile(gradient, (N_TERMS, 1, 1)),
    )


def _plates(prior: PriorCard, values: Values, rng: np.random.Generator) -> list[Mapping[str, Floats]]:
    """Plates drawn from the prior; those of no material, nu_xy nu_yx >= 1, are passed over."""
    plain = {name: value for name, value in values.items() if name not in (*MODULI, *RIGIDITIES)}
    drawn = {name: one.sample(rng, _N_PLATES) for name, one in prior.constants.items()}
    every = ({name: np.asarray(each[i]) for name, each in drawn.items()} for i in range(_N_PLATES))
    plates = [with_rigidities({**plain, **one}) for one in every]
    return [one for one in plates if all(np.isfinite(one[name]) for name in RIGIDITIES)]
