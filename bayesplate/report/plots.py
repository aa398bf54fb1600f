"""The figures of a result as matplotlib figures, each drawn on request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bayesplate.board.material import MODULI
from bayesplate.campaign.diagnosis import CampaignDiagnosis
from bayesplate.campaign.summary import CampaignSummary
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.errors import Fault, InputError
from bayesplate.estimates.sheet import Sheet
from bayesplate.planning.bench import Bench
from bayesplate.planning.plan import Plan
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.posing import PosedProblem
from bayesplate.report.board import board_picture
from bayesplate.report.campaign import boards_picture, common_picture, left_out_picture, shared_picture
from bayesplate.report.chladni import chladni_sheet
from bayesplate.report.constants import constants_figure, percentiles_pictures
from bayesplate.report.corner_plot import axis_labels, corner_figure, corner_picture, words_and_factor
from bayesplate.report.diagnosis import before_after_picture, null_picture, signatures_picture
from bayesplate.report.modes import modes_pictures, predictive_picture, residuals_picture, shares_picture
from bayesplate.report.planning import bench_sheet, gains_picture
from bayesplate.report.posterior import health_picture, priors_picture
from bayesplate.report.style import Picture
from bayesplate.results.checking import CheckReport
from bayesplate.results.summary import Summary
from bayesplate.results.words import GPA

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Plots:
    """Figures by name."""

    def __repr__(self) -> str:
        names = (name for name in dir(self) if not name.startswith("_") and callable(getattr(self, name)))
        return f"<figures: {', '.join(f'.{name}()' for name in names)}>"


@dataclass(frozen=True, eq=False, repr=False)
class FitPlots(Plots):
    """The figures of a fit."""

    draws: Draws
    summary: Summary

    def constants(self) -> Figure:
        """Posterior of each modulus, with least squares and the percentile band."""
        return constants_figure(self.summary, self.draws.moduli)

    def modes(self, setup: str | None = None) -> Figure:
        """Chladni figures of the fitted modes of a setup, the first unless named, measured and predicted."""
        names = [setup.name for setup in self.draws.problem.board.setups]
        return modes_pictures(self.draws, self.summary)[_name_index("setup", setup, names)].figure

    def corner(self, names: Sequence[str] = MODULI) -> Figure:
        """Every pair of quantities, by the package corner; least-squares estimates are marked.

        The names, each once, are of moduli, rigidities and uncertain inputs; moduli are drawn in GPa, inputs in the
        units of cards.
        """
        quantities = {**self.draws.moduli, **self.draws.rigidities, **self.draws.inputs}
        if isinstance(names, str) or not len(names) or len(set(names)) < len(names):
            wanted = f"a list of one or more of {', '.join(quantities)}, each once"
            raise InputError(Fault("names", wanted, repr(names) if isinstance(names, str) else f"{list(names)}"))
        for name in names:
            _name_index("name", name, list(quantities))
        axes = {name: words_and_factor(name, self.draws.problem.board) for name in names}
        estimate = self.summary.weighted_least_squares
        marked = {name: estimate[name] if name in estimate.NAMES else None for name in names}
        return corner_figure(
            {name: quantities[name] * factor for name, (_, factor) in axes.items()},
            {name: None if (v := marked[name]) is None else v * factor for name, (_, factor) in axes.items()},
            axis_labels([words for words, _ in axes.values()]),
        )

    def pairs(self) -> Figure:
        """Every pair of the constants, the noise and the inputs that matter most, as in the report."""
        return corner_picture(self.draws).figure

    def priors(self) -> Figure:
        """Prior and posterior of every sampled quantity."""
        return priors_picture(self.draws).figure

    def residuals(self) -> Figure:
        """Residual and leave-one-out error of each mode, cents."""
        return residuals_picture(self.summary).figure

    def predictive(self) -> Figure:
        """Posterior predictive distribution of the next reading of each mode."""
        return predictive_picture(self.summary, self.draws.predictive).figure

    def shares(self) -> Figure:
        """Energy of each mode by constant, and its leverage."""
        return shares_picture(self.summary, self.draws.problem.identifiability).figure

    def percentiles(self) -> Figure:
        """The percentile method's estimates beside the posterior."""
        picture = next(iter(percentiles_pictures(self.draws)), None)
        wanted, got = "a board of a few modes more than three", "too few, too many, or no estimate"
        return _figure_of_picture(picture, "plot.percentiles", wanted, got)

    def sampler(self) -> Figure:
        """Mean of each ensemble, step by step."""
        return health_picture(self.draws.inference).figure

    def board(self) -> Figure:
        """The board to scale, its edges, hammer and sensors."""
        return board_picture(self.draws.problem.board).figure


@dataclass(frozen=True, eq=False, repr=False)
class DiagnosePlots(FitPlots):
    """The figures of a diagnosis, and those of the fit that it ends with."""

    diagnosis: Diagnosis

    def signatures(self) -> Figure:
        """Shift of the modes by each candidate effect."""
        picture = signatures_picture(self.diagnosis)
        return _figure_of_picture(picture, "plot.signatures", "a diagnosis with candidates", "one without")

    def null_control(self) -> Figure:
        """The board's statistics among those of boards simulated without any further effect."""
        picture = null_picture(self.diagnosis)
        return _figure_of_picture(picture, "plot.null_control", "readings by which something can be judged", "too few")

    def before_after(self) -> Figure:
        """Error before and after the refit, and the shift of the constants."""
        picture = before_after_picture(self.diagnosis)
        return _figure_of_picture(
            picture, "plot.before_after", "a diagnosis that adds an effect", self.diagnosis.verdict
        )


@dataclass(frozen=True, eq=False, repr=False)
class PlanPlots(Plots):
    """The figures of a plan."""

    plan: Plan
    benches: Sequence[Bench]

    def gains(self) -> Figure:
        """Expected gain of each proposal."""
        return gains_picture(self.plan).figure

    def bench(self, setup: str | None = None) -> Figure:
        """The bench sheet of a setup, the first unless named."""
        return bench_sheet(self.benches[_name_index("setup", setup, [bench.entry.setup for bench in self.benches])])


@dataclass(frozen=True, eq=False, repr=False)
class ModesPlots(Plots):
    """The sheets of Chladni figures."""

    sheets: tuple[Sheet, ...]

    def modes(self, setup: str | None = None) -> Figure:
        """The sheet of a setup, the first unless named."""
        return chladni_sheet(self.sheets[_name_index("setup", setup, [sheet.setup for sheet in self.sheets])])


@dataclass(frozen=True, eq=False, repr=False)
class CheckPlots(Plots):
    """The figures of a check, which need no sampling."""

    problem: PosedProblem
    report: CheckReport

    def shares(self) -> Figure:
        """Energy of each mode by constant, and its leverage."""
        return shares_picture(self.report, self.problem.identifiability).figure

    def board(self) -> Figure:
        """The board to scale, its edges, hammer and sensors."""
        return board_picture(self.problem.board).figure


@dataclass(frozen=True, eq=False, repr=False)
class ComparePlots(Plots):
    """The figures of a comparison: posteriors by plate theory."""

    draws: Mapping[str, Draws]

    def corner(self, theory: str = "thin") -> Figure:
        """Every pair of moduli under one theory, by the package corner."""
        _name_index("theory", theory, list(self.draws))
        columns = {f"{name}, GPa": values * GPA for name, values in self.draws[theory].moduli.items()}
        return corner_figure(columns, labels=axis_labels(list(columns)))


def _figure_of_picture(picture: Picture | None, place: str, wanted: str, got: str) -> Figure:
    """The figure of a picture; refused where there is none."""
    if picture is None:
        raise InputError(Fault(place, wanted, got))
    return picture.figure


def _name_index(kind: str, name: str | None, names: Sequence[str]) -> int:
    """Index of a name among `names`, 0 for None; InputError for another name, or where there is none."""
    if not names:
        raise InputError(Fault(kind, f"one {kind} or more", "none"))
    if name is not None and name not in names:
        raise InputError(Fault(kind, f"one of {', '.join(names)}", repr(name)))
    return 0 if name is None else list(names).index(name)


@dataclass(frozen=True, eq=False, repr=False)
class CampaignPlots(Plots):
    """The figures of a campaign, and of its diagnosis where there is one."""

    summary: CampaignSummary
    diagnosis: CampaignDiagnosis | None = None

    def shared(self, name: str | None = None) -> Figure:
        """A shared number, the first unless named: from each board alone, from the others, from all boards."""
        names = list(self.summary.shared)
        return shared_picture(self.summary, names[_name_index("shared number", name, names)]).figure

    def boards(self) -> Figure:
        """The constants of all boards."""
        return boards_picture(self.summary).figure

    def common(self) -> Figure:
        """Residuals that all boards have in common."""
        return common_picture(self.summary.common_residual).figure

    def left_out(self) -> Figure:
        """Gain in log score of each left-out board, predicted from the others."""
        if self.diagnosis is None or not self.diagnosis.left_out_boards:
            wanted, remedy = "a diagnosis that left boards out", "bayesplate.diagnose leaves them out"
            raise InputError(Fault("left_out", wanted, "a fit, or nothing shared", remedy))
        return left_out_picture(self.diagnosis).figure
