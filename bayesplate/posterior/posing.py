"""From a board to a problem of inference, in three steps: the estimate, the choice of the law, and the posterior."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, RIGIDITIES, moduli_of
from bayesplate.board.prior import PriorCard
from bayesplate.board.sessions import with_discrepancies
from bayesplate.effects.words import join_words
from bayesplate.errors import InputError, NotIdentifiableError
from bayesplate.estimates.coefficients import coefficient_faults
from bayesplate.estimates.identifiability import (
    Identifiability,
    identifiability,
    require_identifiable,
    require_labels,
)
from bayesplate.estimates.least_squares import Estimate, weighted_least_squares
from bayesplate.estimates.unusual import odd_reading, unusual_sentences
from bayesplate.frequencies.laws import LawName
from bayesplate.frequencies.prior_bands import prior_medians
from bayesplate.posterior.first_labels import ProposedLabels, propose_labels
from bayesplate.posterior.laplace import laplace_approximation, linearisation_errors
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.slips import Remarks, is_noise_large, noise_remarks, reading_remarks
from bayesplate.posterior.target import Posterior, linear_suffices
from bayesplate.posterior.veerings import with_veering_doubts

_N_CHECKS = 256
_N_NAMED = 64
"""Number of these draws at which modes are named."""
_NEXT_TO_NOTHING = 0.01
"""Share of the median of its prior below which a rigidity is hardly there."""
_N_TRIED = 1000
_SPREAD = 3.0
"""Spread, in standard errors, of the draws on which a prior is tested, as of the sampler's starts."""
_NOISE_SDS = 6.0
"""The largest noise that a prior allows is taken so many standard deviations of its logarithm above the median."""
_IMPOSSIBLE_MISFIT = 1e4
"""Chi^2 per degree of freedom at that noise above which its prior contradicts the readings: residuals a hundred times
as large. A missing effect leaves smaller residuals, and is for `diagnose` to find."""
_UNITS = {**dict.fromkeys(MODULI, (1e9, "GPa")), **dict.fromkeys(RIGIDITIES, (1.0, "N m"))}


@dataclass(frozen=True, eq=False)
class PosedProblem:
    """A board posed as a problem of inference: its estimate, both laws, and the location of the posterior."""

    board: Board
    prior: PriorCard
    estimate: Estimate
    identifiability: Identifiability
    posterior: Posterior  # its models hold both laws
    centre: Floats  # (n_dim,), with the covariance a normal approximation of the posterior, for the starts
    covariance: Floats  # (n_dim, n_dim)
    is_forced: bool = False  # the user chose the law: it is sampled itself, without a surrogate
    veerings: tuple[str, ...] = ()  # a sentence for each setup with doubtful labels near a veering

    @property
    def parameters(self) -> Parameters:
        return self.posterior.parameters

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Sentences about unusual constants and readings, before anything is sampled."""
        # at the fitted inputs: at the nominal sizes a board with a soft core looks like another board
        values = self.parameters.values_at(self.centre)
        constants = unusual_sentences(self.board, self.prior, np.array([values[name] for name in RIGIDITIES]))
        return (*constants, *self.slip_remarks, *self._readings.other_remarks)

    @property
    def slip_remarks(self) -> tuple[str, ...]:
        """The doubts that identify a reading or two as a slip."""
        return self._readings.slip_remarks

    @cached_property
    def _readings(self) -> Remarks:
        if any(self.posterior.peaks):  # the assignment of peaks treats doubtful labels
            return Remarks((), (*self.veerings, *noise_remarks(self.board, self.parameters.log_widenings(self.centre))))
        return reading_remarks(self.posterior, self.centre)

    @property
    def log_widening(self) -> float:
        """ln of the noise at the centre over the median of its prior, in the setup where that is largest."""
        return self.parameters.log_widening(self.centre)

    def under(self, law: LawName) -> PosedProblem:
        """The same problem under another law."""
        posterior = self.posterior
        return replace(
            self, posterior=Posterior(posterior.board, posterior.prior, posterior.models, law, posterior.robust)
        )


def pose(board: Board, prior: PriorCard, *, law: LawName | None = None, robust: bool = False) -> PosedProblem:
    """Estimate by least squares, check that the constants are identifiable, build both laws and choose one.

    By default the linear law is chosen where its error over the normal approximation of the posterior, widened because
    the noise is unknown, stays below a quarter of the expected noise for all modes. Labels that may belong to another
    mode near a veering become doubtful (`bayesplate.posterior.veerings`). InputError if a published table is of another
    setup; NotIdentifiableError if the labelled modes do not determine a constant, or contradict the prior or the noise.
    """
    faults = coefficient_faults(board)
    if faults:
        raise InputError(faults)
    problem = _pose_labelled(propose_labels(board, prior), prior, law, robust)
    if law == "linear":  # chosen by the user: it follows the shapes, not the ranks
        return problem
    return _pose_with_doubts(problem, law)


def _pose_labelled(proposed: ProposedLabels, prior: PriorCard, law: LawName | None, robust: bool) -> PosedProblem:
    """Pose the problem with its labels as they are."""
    board = with_discrepancies(proposed.board)
    require_labels(board)
    estimate = weighted_least_squares(board, start=proposed.rigidities)
    verdict = identifiability(estimate.sensitivities, estimate.scales, board.symmetry)
    try:
        require_identifiable(board, verdict)
    except NotIdentifiableError:
        _ask_about_labels(board, prior, estimate)
        raise
    try:
        centre, covariance, models = laplace_approximation(board, estimate, robust, proposed.spread)
    except np.linalg.LinAlgError:
        raise NotIdentifiableError(_no_plate_sentence(board, estimate)) from None
    values = Parameters(board).values_at(centre)
    sensitivities = np.concatenate([model.sensitivities(values) for model in models])
    # The order of the modes may be different at the centre of the posterior and at the estimate.
    require_identifiable(board, identifiability(sensitivities, estimate.scales, board.symmetry))
    chosen_law = law
    if chosen_law is None:
        errors = linearisation_errors(board, models, _plausible_draws(board, centre, covariance))
        medians = [setup.noise.median for setup in board.setups]
        is_linear = linear_suffices([len(model.mode_places) for model in models], errors, medians)
        chosen_law = "linear" if is_linear else "exact"
    posterior = Posterior(board, prior, models, chosen_law, robust)
    _require_reachable(posterior, centre, covariance)
    require_possible_noise(posterior, centre)
    return PosedProblem(board, prior, estimate, verdict, posterior, centre, covariance, law is not None)


def _pose_with_doubts(problem: PosedProblem, law: LawName | None) -> PosedProblem:
    """The problem posed again with doubtful labels near a veering, if there are any."""
    draws = _plausible_draws(problem.board, problem.centre, problem.covariance)[:_N_NAMED]
    plates = problem.parameters.values(np.concatenate([problem.centre[None], draws]))
    doubtful_board, remarks = with_veering_doubts(problem.board, problem.posterior.models, plates)
    if doubtful_board is problem.board:
        return problem
    try:
        reposed = _pose_labelled(
            propose_labels(doubtful_board, problem.prior), problem.prior, law, problem.posterior.robust
        )
    except NotIdentifiableError:
        return problem
    if all(is_noise_large(posed.board, posed.log_widening) for posed in (problem, reposed)):
        return problem  # another fault makes wrong plates look plausible
    return replace(reposed, veerings=remarks)


def _plausible_draws(board: Board, centre: Floats, covariance: Floats) -> Floats:
    """Draws of the normal approximation, wider because the noise is unknown, within the limits of the inputs."""
    parameters = Parameters(board)
    draws = np.random.default_rng(0).multivariate_normal(centre, covariance, _N_CHECKS)
    spare = max(sum(len(setup.readings) for setup in board.setups) - board.symmetry.n, 0)
    log_sd = max(setup.noise.log_sd for setup in board.setups)
    # Root mean square of the noise over its median: the precision of ln noise is the prior's plus 2 per spare reading.
    widening = float(np.exp(1.0 / (1.0 / log_sd**2 + 2.0 * spare)))
    constants = slice(parameters.n_constants)
    draws[:, constants] += (widening - 1.0) * (draws - centre)[:, constants]
    return parameters.within_bounds(draws)


def _no_plate_sentence(board: Board, estimate: Estimate) -> str:
    """Words on readings whose best fit lies where plates end, with the reading that does not fit the others."""
    constants = ", ".join(
        f"{name} {1e-9 * float(value):.3g} GPa" for name, value in zip(MODULI, moduli_of(estimate.values), strict=True)
    )
    return (
        f"{board.name}: its readings fit best where constants are those of no plate any more ({constants}); nothing "
        f"was sampled: {odd_reading(board)}look for a reading that is a decimal place off or has another's label, and "
        "for sides that are exchanged"
    )


def _require_reachable(posterior: Posterior, centre: Floats, covariance: Floats) -> None:
    """Refuse a prior that is zero at all draws from the normal approximation, widened three times."""
    draws = np.random.default_rng(0).multivariate_normal(centre, _SPREAD**2 * covariance, _N_TRIED)
    if np.isfinite(posterior.log_prior_constants(posterior.parameters.within_bounds(draws))).any():
        return
    values = posterior.parameters.values_at(centre)
    elastic = moduli_of(values)
    constants = values | elastic._asdict()
    outside = []
    for name, density in posterior.priors.items():
        value = float(constants[name])
        if not density.lower <= value <= density.upper:
            factor, unit = _UNITS[name]
            low, high = density.lower / factor, density.upper / factor
            shown_name = posterior.board.symmetry.moduli[0] if posterior.board.isotropic else name
            outside.append(f"{shown_name} is about {value / factor:.3g} {unit}, the prior wants {low:g} to {high:g}")
    ranges = f" ({'; '.join(outside)})" if outside else ""
    raise NotIdentifiableError(
        f"{posterior.board.name}: the prior {posterior.prior.name} excludes the data: 0 of {_N_TRIED} draws around the "
        f"least-squares estimate have a density under it{ranges}; nothing was sampled: "
        "check the prior, the labels and the units"
    )


def _ask_about_labels(board: Board, prior: PriorCard, estimate: Estimate) -> None:
    """NotIdentifiableError with a question where the estimate has next to nothing of a constant, and leaves it open.

    On a usual plate of the prior the modes would tell it: the readings contradict each other.
    """
    medians = prior_medians(board, prior)
    usual_plate = np.array([float(medians[name]) for name in RIGIDITIES])
    missing = [
        name
        for name, share in zip(RIGIDITIES, estimate.rigidities / usual_plate, strict=True)
        if share < _NEXT_TO_NOTHING
    ]
    first = weighted_least_squares(board, 1, usual_plate)
    told = identifiability(first.sensitivities, first.scales, board.symmetry)
    if missing and not told.undetermined_constants():
        names = join_words(missing)
        raise NotIdentifiableError(
            f"{board.name}: these modes tell {names} of a usual board, and these readings do not: they fit best where "
            f"{names} is next to nothing. Does each label belong to its frequency?"
        )


def require_possible_noise(posterior: Posterior, centre: Floats) -> None:
    """Refuse a prior of the noise that is far too small for the residuals at the centre, by the exact law."""
    board, values = posterior.board, posterior.parameters.values(centre[None, :])
    largest = [setup.noise.median * np.exp(_NOISE_SDS * setup.noise.log_sd) for setup in board.setups]
    squares, n_modes = 0.0, 0
    for readings, model, noise in zip(posterior.readings, posterior.models, largest, strict=True):
        predicted = model.log_frequencies(values, "exact")[0]
        gaps = np.maximum(np.maximum(readings.log_low - predicted, predicted - readings.log_high), 0.0)
        squares += float(np.sum((gaps / np.hypot(noise, readings.own_sd)) ** 2))
        n_modes += gaps.size
    misfit = squares / max(n_modes - board.symmetry.n, 1)
    if not misfit > _IMPOSSIBLE_MISFIT:
        return
    levels = ", ".join(
        f"{100.0 * noise:.2g} %" + (f" in setup {setup.name}" if len(board.setups) > 1 else "")
        for setup, noise in zip(board.setups, largest, strict=True)
    )
    raise NotIdentifiableError(
        f"{board.name}: the declared noise contradicts the data: chi^2 / dof = {misfit:.2g} at a noise of {levels}, "
        "the most that its prior allows; nothing was sampled: look for a reading that is a decimal place off, or has "
        "another's label, or state noise_percent as large as repeated readings differ"
    )
