"""A board as a problem of Bayesian inference: its densities, its frequencies, and the map from the unit cube."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.prior import PriorCard
from bayesplate.board.sessions import session_groups
from bayesplate.board.values import Key
from bayesplate.commands.arguments import check_arguments, optional_reader, read_prior
from bayesplate.commands.options import CARD, Effects, Law, Robust, SetupFile
from bayesplate.commands.prepare import CardSource, PreparedBoard, prepare
from bayesplate.errors import Fault, InputError, NotIdentifiableError
from bayesplate.frequencies.laws import LawName
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.posing import PosedProblem, pose
from bayesplate.posterior.target import Posterior


@dataclass(frozen=True, eq=False, repr=False)
class Problem:
    """The inference of a board's constants: densities, frequencies and the prior, as any sampler asks for them.

    theta holds, in the order of `names`: ln D_x, ln D_y, ln D_s (N m), of an isotropic board ln D alone (D_x = D_y = D
    and D_s = 2 (1 - nu) D); ln of the relative noise, one per setup; and one standard coordinate z per uncertain input
    of the board or of a declared effect, standard normal under its prior within the bounds of the quantity.

    Every method takes one point or many: an (n_dim,) array gives a number or a vector, an (n, n_dim) array gives n of
    them. The plates are solved once, when a likelihood or a frequency is first asked for.

    Attributes
    ----------
    prepared : PreparedBoard
        The card, the prior and the board.
    asked_law : "linear", "exact" or None
        None: the linear law where it is good enough.
    robust : bool
        Student's distribution for the noise.

    Examples
    --------
    >>> import bayesplate
    >>> problem = bayesplate.Problem.from_card("fiemme-spruce-clamped")
    >>> problem.names
    ('log_D_x', 'log_D_y', 'log_D_s', 'log_noise[clamped]')
    """

    prepared: PreparedBoard
    asked_law: LawName | None = None
    robust: bool = False

    @classmethod
    @check_arguments()
    def from_card(
        cls,
        card: Annotated[CardSource, CARD],
        effects: Effects = None,
        prior: Annotated[str | os.PathLike[str] | PriorCard | None, Key(optional_reader(read_prior))] = None,
        law: Law = None,
        robust: Robust = False,
        setup: SetupFile = None,
    ) -> Problem:
        """The problem of a card, or of a board made in Python.

        Parameters
        ----------
        card : str, path or Board
            Name of a shipped board card, or a path.
        effects : sequence of str, optional
            Declared effects in place of the card's.
        prior : str, path or PriorCard, optional
            In place of the prior that the card names.
        law : "linear" or "exact", optional
            By default the linear law where it is good enough.
        robust : bool
            Student's distribution for the noise.
        setup : str or path, optional
            A file with a table [setup] that takes the place of the card's, key by key: what `pick` writes.

        Returns
        -------
        Problem

        Raises
        ------
        InputError
            With every fault of the card, or of the card that the board would have.
        """
        return cls(prepare(card, effects, prior=prior, setup=setup), law, robust)

    @property
    def board(self) -> Board:
        """The board as its card states it; `dataclasses.replace` makes another one of it."""
        return self.prepared.card

    @property
    def prior(self) -> PriorCard:
        """The prior of the constants."""
        return self.prepared.prior

    @cached_property
    def _sampled_board(self) -> Board:
        """The board whose parameters are sampled; sessions share some by their labels, which posing may propose."""
        return self.posed.board if session_groups(self.prepared.board) else self.prepared.board

    @cached_property
    def _parameters(self) -> Parameters:
        return Parameters(self._sampled_board)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns of theta."""
        return self._parameters.names

    @property
    def n_dim(self) -> int:
        """Number of columns of theta."""
        return self._parameters.n_dim

    @property
    def labels(self) -> tuple[str, ...]:
        """Setup and label of every reading, in the order of `predict`: "cantilever (1,0)"."""
        return self.board.reading_names

    @cached_property
    def posed(self) -> PosedProblem:
        """The estimate, both laws and the normal approximation of the posterior.

        Raises
        ------
        NotIdentifiableError
            If the data leave a constant open, or contradict the prior.
        """
        return pose(self.prepared.board, self.prior, law=self.asked_law, robust=self.robust)

    @property
    def law(self) -> LawName:
        """The law of the likelihood and of `predict`: "linear" or "exact"."""
        return self.posed.posterior.law

    @cached_property
    def _prior_density(self) -> Posterior:
        """The prior alone, for which no plate has to be solved but those of sessions."""
        return Posterior(self._sampled_board, self.prior, (), self.asked_law or "exact", self.robust)

    def log_prob(self, theta: ArrayLike) -> Floats:
        """Log density of the posterior, up to a constant: `log_prior` plus `log_likelihood`.

        Parameters
        ----------
        theta : (n_dim,) or (n, n_dim) array

        Returns
        -------
        number or (n,) array
            -inf outside the prior.
        """
        return self._evaluate(self.posed.posterior, theta, ())

    def log_prior(self, theta: ArrayLike) -> Floats:
        """Log density of the prior, of the columns of theta.

        Parameters
        ----------
        theta : (n_dim,) or (n, n_dim) array

        Returns
        -------
        number or (n,) array
            -inf outside the bounds, and where no material exists: nu_xy nu_yx >= 1.
        """
        return self._evaluate(self._prior_density.log_prior, theta, ())

    def log_likelihood(self, theta: ArrayLike) -> Floats:
        """Log probability of all readings.

        Parameters
        ----------
        theta : (n_dim,) or (n, n_dim) array

        Returns
        -------
        number or (n,) array
            -inf where the prior is zero, never not-a-number.
        """
        posterior = self.posed.posterior
        return self._evaluate(lambda rows: posterior.log_likelihood(rows).sum(axis=1), theta, ())

    def predict(self, theta: ArrayLike) -> Floats:
        """Frequencies of the labelled modes, without noise, under the law of the problem.

        The linear law holds near the estimate only: for draws of the prior it is off by tens to hundreds of cents, and
        so is the likelihood. `Problem.from_card(card, law="exact")` holds for them too.

        Parameters
        ----------
        theta : (n_dim,) or (n, n_dim) array

        Returns
        -------
        (n_modes,) or (n, n_modes) array, Hz
            In the order of `labels`; not a number where the prior is zero. A label that the card states as uncertain
            may be predicted as the mode that fits its reading better.
        """
        posterior = self.posed.posterior

        def hertz(rows: Floats) -> Floats:
            by_setup = zip(posterior.log_frequencies(rows), self.board.setups, strict=True)
            return np.exp(np.concatenate([columns[:, : len(setup.readings)] for columns, setup in by_setup], axis=1))

        return self._evaluate(hertz, theta, (len(self.labels),), outside=np.nan)

    def prior_transform(self, u: ArrayLike) -> Floats:
        """Points of the unit cube as points under the prior, as nested samplers ask for them.

        Parameters
        ----------
        u : (n_dim,) or (n, n_dim) array, 0 to 1

        Returns
        -------
        array of the same shape
            theta. Where the drawn moduli are those of no material, `log_likelihood` is -inf.
        """
        rows = self._rows("u", u)
        if not ((rows >= 0.0) & (rows <= 1.0)).all():
            outside = rows[~((rows >= 0.0) & (rows <= 1.0))][0]
            raise InputError(Fault("u", "numbers from 0 to 1", f"{outside:g}"))
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            theta = self._prior_density.prior_transform(rows)
        return theta if np.ndim(u) == 2 else theta[0]

    def __repr__(self) -> str:
        setups = ", ".join(setup.name for setup in self.board.setups)
        description = f"{len(self.labels)} readings ({setups}), {self.n_dim} parameters, prior {self.prior.name}"
        return f"<Problem of {self.board.name}: {description}>"

    def _rows(self, name: str, points: ArrayLike) -> Floats:
        """Points as rows: (n, n_dim) array."""
        wanted = f"an array of shape ({self.n_dim},) or (n, {self.n_dim}), columns {', '.join(self.names)}"
        try:
            array = np.asarray(points, dtype=np.float64)
        except (TypeError, ValueError):
            raise InputError(Fault(name, wanted, type(points).__name__)) from None
        if array.ndim not in (1, 2) or array.shape[-1] != self.n_dim:
            raise InputError(Fault(name, wanted, f"one of shape {array.shape}"))
        return np.atleast_2d(array)

    def _evaluate(
        self, function: Callable[[Floats], Floats], theta: ArrayLike, shape: tuple[int, ...], outside: float = -np.inf
    ) -> Floats:
        """The values of a function at the points where the prior is not zero, and `outside` elsewhere."""
        rows = self._rows("theta", theta)
        values = np.full((len(rows), *shape), outside)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            inside: NDArray[np.bool_] = np.asarray(np.isfinite(rows).all(axis=1))
            inside[inside] = np.isfinite(self._prior_density.log_prior(rows[inside]))
            if inside.any():
                values[inside] = function(rows[inside])
        values[np.isnan(values)] = outside
        return values if np.ndim(theta) == 2 else values[0][()]


def pose_all(problems: Sequence[Problem]) -> None:
    """Solve boards around their estimates before anything is sampled; NotIdentifiableError names all that fail."""
    failures = []
    for problem in problems:
        try:
            _ = problem.posed
        except NotIdentifiableError as error:
            if len(problems) == 1:
                raise
            name = f"{problem.board.name}: "
            failures.append(name + str(error).removeprefix(name))
    if failures:
        raise NotIdentifiableError("\n".join(failures))


def as_problem(
    card: Problem | CardSource,
    *,
    effects: Sequence[str] | None = None,
    law: LawName | None = None,
    robust: bool = False,
    setup: str | os.PathLike[str] | None = None,
    may_lack_frequencies: bool = False,
) -> Problem:
    """The card of a command as a problem; raises InputError for a Problem with options that it states itself."""
    if not isinstance(card, Problem):
        prepared = prepare(card, effects, setup=setup, may_lack_frequencies=may_lack_frequencies)
        return Problem(prepared, law, robust)
    is_stated = {"effects": effects is not None, "law": law is not None, "robust": robust, "setup": setup is not None}
    if any(is_stated.values()):
        names = ", ".join(name for name, is_given in is_stated.items() if is_given)
        raise InputError(Fault(names, "nothing beside a Problem", "a value", "Problem.from_card takes it"))
    return card


def require_normal_noise(problems: Sequence[Problem]) -> None:
    """Refuse problems with robust noise; raises InputError."""
    if any(problem.robust for problem in problems):
        wanted = "a problem with normal noise, which the search for an effect assumes"
        raise InputError(Fault("robust", wanted, "Student's distribution"))
