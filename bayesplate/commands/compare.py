"""`compare`: every method side by side, on the thin and on the shear-flexible plate; nothing is written unasked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, get_args

from bayesplate.commands.arguments import check_arguments
from bayesplate.commands.check import expected_sd
from bayesplate.commands.fitting import convergence_error
from bayesplate.commands.options import CARD, CoefficientChoice, CompareOut, Effects, Force, OnProgress, Seed, SetupFile
from bayesplate.commands.prepare import CardSource
from bayesplate.commands.printout import Printout, show_compare
from bayesplate.commands.problem import Problem, as_problem
from bayesplate.effects import EFFECTS
from bayesplate.estimates.coefficients import named_table
from bayesplate.estimates.leave_one_out import CarryingMode, unite_carrying_modes
from bayesplate.estimates.paper import paper_system
from bayesplate.files import make_folder, require_new_files, write_text
from bayesplate.frequencies.laws import LawName
from bayesplate.posterior.assessment import carried_in_fit, mode_errors
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import infer
from bayesplate.posterior.likely_labels import with_likely_labels
from bayesplate.posterior.posing import PosedProblem, pose
from bayesplate.posterior.reweighting import law_weights
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.posterior.statistics import effective_draws
from bayesplate.report.plots import ComparePlots
from bayesplate.results.archive import posterior_tree, to_arviz
from bayesplate.results.comparison import (
    FORMAT,
    Comparison,
    MethodRow,
    TheoryRow,
    better_theory,
    recompute_left_out_errors,
    theory_row,
)
from bayesplate.results.contract import NOT_IN_JSON, json_text
from bayesplate.results.methods import point_methods, posterior_method
from bayesplate.results.summary import versions

COMPARISON_FILE = "compare.json"
FEWEST_DRAWS = 1000
"""Effective draws after reweighting; with fewer of them the other law is sampled itself."""

_SHEAR_EFFECTS = tuple(name for name, effect in EFFECTS.items() if effect.theory == "shear-flexible")
"""Effects that make the plate shear-flexible."""


@dataclass(frozen=True, repr=False)
class CompareResult(Comparison):
    """Result of `compare`: all of `Comparison`, and the draws.

    Attributes
    ----------
    sampled : dict of Draws
        The posterior under the exact law, by theory of the plate.
    """

    sampled: Mapping[str, Draws] = field(metadata=NOT_IN_JSON, compare=False)

    @property
    def summary(self) -> Comparison:
        """What compare.json holds: the comparison itself."""
        return self

    @property
    def plot(self) -> ComparePlots:
        """The figures: `comparison.plot.corner("thin")`."""
        return ComparePlots(self.sampled)

    def to_arviz(self) -> dict[str, Any]:
        """The posterior of each theory as of `bayesplate.FitResult.to_arviz`: what `arviz.compare` takes.

        Returns
        -------
        dict of arviz.InferenceData or xarray.DataTree
        """
        about = {"seed": str(self.seed), "prior": self.prior, "card_sha256": self.card_sha256}
        return {
            theory: to_arviz(posterior_tree(draws, about | {"theory": theory}))
            for theory, draws in self.sampled.items()
        }

    def __repr__(self) -> str:
        return super().__repr__().replace("<Comparison", "<CompareResult", 1)

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_compare(self)

    def _repr_html_(self) -> str:
        return self.printout().html(f"{self.name}: every method side by side")


@check_arguments()
def compare(
    card: Annotated[Problem | CardSource, CARD],
    *,
    coefficients: CoefficientChoice = None,
    seed: Seed = 1,
    effects: Effects = None,
    setup: SetupFile = None,
    out: CompareOut = None,
    force: Force = False,
    progress: OnProgress = None,
) -> CompareResult:
    """Compare all methods on a board, as a thin and as a shear-flexible plate.

    Parameters
    ----------
    card : Problem, str, path or Board
        A problem, the name of a shipped board card, the path of a card, or a board made in Python. Both frequency laws
        are compared whatever the law of a problem.
    coefficients : "sensitivity", "training" or "published", optional
        Source of the coefficients of the paper's least squares and percentile method; by default the published table
        where the card names one, else the sensitivity of one solve.
    seed : int
        Everything random follows from it.
    effects : sequence of str, optional
        Declared effects in place of the card's. Transverse shear is left out of the thin plate and added to the other;
        its moduli are the card's, or the effect's own prior.
    setup : path, optional
        A file with a table [setup] that takes the place of the card's, key by key: what `pick` writes.
    out : path, optional
        Folder for compare.json; nothing is written without it.
    force : bool
        Replace a compare.json that is there.
    progress : callable, optional
        Called after every chunk of sampling.

    Returns
    -------
    CompareResult

    Raises
    ------
    InputError
        If the card, the table or the folder cannot be used; then nothing is written.
    NotIdentifiableError
        If the data leave a constant open.
    NotConvergedError
        If the sampler fails its gate.
    """
    files = require_new_files(Path(out), [COMPARISON_FILE], force=force) if out is not None else ()
    base_problem = as_problem(card, effects=effects, setup=setup)
    other_effects = [name for name in base_problem.prepared.board.effects if name not in _SHEAR_EFFECTS]
    effect_sets = [other_effects, [*other_effects, *_SHEAR_EFFECTS]]
    prepared_boards = [base_problem.prepared.with_effects(names) for names in effect_sets]
    if coefficients == "published":
        board = prepared_boards[0].board
        for own_setup in board.setups:
            named_table(board.name, own_setup)
    problems = [
        pose(prepared.board, prepared.prior, robust=base_problem.robust).under("exact") for prepared in prepared_boards
    ]
    for problem in problems:  # what cannot be used is refused before anything is sampled
        paper_system(problem.board, problem.estimate, coefficients, compared=False)
    theories: list[TheoryRow] = []
    carrying_modes: list[CarryingMode] = []
    sampled: dict[str, Draws] = {}
    for problem in problems:
        posteriors, draws = _posteriors(problem, SamplerSettings(seed=seed), progress)
        labelled = draws.problem  # as the draws label its peaks: all methods are held against the same readings
        system = paper_system(labelled.board, labelled.estimate, coefficients)
        methods = [*point_methods(labelled, system, expected_sd(labelled)), *posteriors]
        errors = mode_errors(draws)
        theories.append(theory_row(labelled, system, methods, errors))
        carrying_modes += carried_in_fit(labelled.board, errors)
        sampled[theories[-1].theory] = draws
    united_modes = unite_carrying_modes(carrying_modes)
    compared_theories = recompute_left_out_errors(theories, united_modes)
    result = CompareResult(
        format=FORMAT,
        name=problems[0].board.name,
        seed=seed,
        versions=versions(),
        card_sha256=prepared_boards[0].card.sha256,
        prior=problems[0].prior.name,
        theories=compared_theories,
        verdict=better_theory(*compared_theories),
        carrying_modes=united_modes,
        sampled=sampled,
    )
    for path in files:
        make_folder(path.parent)
        write_text(path, json_text(result))
    return result


def _posteriors(
    problem: PosedProblem, settings: SamplerSettings, progress: OnProgress
) -> tuple[list[MethodRow], Draws]:
    """The posteriors of both laws, of the problem as the exact draws label its peaks.

    The wider, exact one is sampled; the linear one has its draws by weights, where these leave enough.
    """
    draws = _sample(problem, settings, progress)
    problem = draws.problem
    methods = []
    for law in get_args(LawName):
        weights = law_weights(draws, law)
        if effective_draws(weights) >= FEWEST_DRAWS:
            methods.append(posterior_method(f"{law}_posterior", problem, draws, weights))
        else:
            law_draws = _sample(problem.under(law), settings, progress)
            methods.append(posterior_method(f"{law}_posterior", problem, law_draws, law_weights(law_draws, law)))
    return methods, draws


def _sample(problem: PosedProblem, settings: SamplerSettings, progress: OnProgress) -> Draws:
    inference = infer(problem, settings, progress=progress)
    if not inference.convergence.passed:
        raise convergence_error(inference.convergence, problem.doubts, consequence="nothing is compared")
    return with_likely_labels(inference, settings.seed)
