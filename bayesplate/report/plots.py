"""The figures of a result, each drawn when it is asked for, as matplotlib has them."""

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
from bayesplate.posterior.inference import Inference
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

    inference: Inference
    draws: Draws
    summary: Summary

    def constants(self) -> Figure:
        """Posterior of each modulus, least squares and percentile band beside it."""
        return constants_figure(self.summary, self.draws.moduli)

    def modes(self, setup: str | None = None) -> Figure:
        """Chladni figures of the fitted modes of a setup, the first unless named, measured and predicted."""
        names = [one.name for one in self.inference.problem.board.setups]
        return modes_pictures(self.inference, self.draws, self.summary)[_place("setup", setup, names)].figure

    def corner(self, names: Sequence[str] = MODULI) -> Figure:
        """Every pair of quantities, by the package corner; least squares marked where there is one.

        The names, each once, are of moduli, rigidities and uncertain inputs; moduli are drawn in GPa, inputs in the
        units of cards.
        """
        known = {**self.draws.moduli, **self.draws.rigidities, **self.draws.inputs}
        if isinstance(names, str) or not len(names) or len(set(names)) < len(names):
            wanted = f"a list of one or more of {', '.join(known)}, each once"
            raise InputError(Fault("names", wanted, repr(names) if isinstance(names, str) else f"{list(names)}"))
        for name in names:
            _place("name", name, list(known))
        shown = {name: words_and_factor(name, self.inference.problem.board) for name in names}
        estimate = self.summary.weighted_least_squares
        at = {name: estimate[name] if name in estimate.NAMES else None for name in names}
        return corner_figure(
            {name: known[name] * factor for name, (_, factor) in shown.items()},
            {name: None if (v := at[name]) is None else v * factor for name, (_, factor) in shown.items()},
            axis_labels([words for words, _ in shown.values()]),
        )

    def pairs(self) -> Figure:
        """Every pair of the constants, the noise and the inputs that matter most, as in the report."""
        return corner_picture(self.inference.problem, self.draws).figure

    def priors(self) -> Figure:
        """Prior and posterior of every quantity that was not known."""
        return priors_picture(self.inference.problem, self.draws).figure

    def residuals(self) -> Figure:
        """How far each mode is missed, cents."""
        return residuals_picture(self.summary).figure

    def predictive(self) -> Figure:
        """What the fitted model would expect the next measurement to read."""
        return predictive_picture(self.summary, self.draws.predictive).figure

    def shares(self) -> Figure:
        """Energy of each mode by constant, and its leverage."""
        return shares_picture(self.summary, self.inference.problem.identifiability).figure

    def percentiles(self) -> Figure:
        """The percentile method's estimates beside the posterior."""
        drawn = next(iter(percentiles_pictures(self.inference, self.draws)), None)
        wanted, got = "a board of a few modes more than three", "too few, too many, or no estimate"
        return _figure(drawn, "plot.percentiles", wanted, got)

    def sampler(self) -> Figure:
        """The way of each ensemble."""
        return health_picture(self.inference).figure

    def board(self) -> Figure:
        """The board to scale, its edges, hammer and sensors."""
        return board_picture(self.inference.problem.board).figure


@dataclass(frozen=True, eq=False, repr=False)
class DiagnosePlots(FitPlots):
    """The figures of a diagnosis, and those of the fit that it ends with."""

    diagnosis: Diagnosis

    def signatures(self) -> Figure:
        """What each candidate effect would do to the modes."""
        drawn = signatures_picture(self.diagnosis)
        return _figure(drawn, "plot.signatures", "a diagnosis with candidates", "one without")

    def null_control(self) -> Figure:
        """Where the board stands among simulated boards that lack nothing."""
        drawn = null_picture(self.diagnosis)
        return _figure(drawn, "plot.null_control", "readings by which something can be judged", "too few")

    def before_after(self) -> Figure:
        """The error before and after, and what the effect does to the constants."""
        drawn = before_after_picture(self.diagnosis)
        return _figure(drawn, "plot.before_after", "a diagnosis that adds an effect", self.diagnosis.verdict)


@dataclass(frozen=True, eq=False, repr=False)
class PlanPlots(Plots):
    """The figures of a plan."""

    plan: Plan
    benches: Sequence[Bench]

    def gains(self) -> Figure:
        """What each proposal is expected to give."""
        return gains_picture(self.plan).figure

    def bench(self, setup: str | None = None) -> Figure:
        """The sheet for the bench of a setup, the first unless named."""
        return bench_sheet(self.benches[_place("setup", setup, [one.entry.setup for one in self.benches])])


@dataclass(frozen=True, eq=False, repr=False)
class ModesPlots(Plots):
    """The sheets of Chladni figures."""

    sheets: tuple[Sheet, ...]

    def modes(self, setup: str | None = None) -> Figure:
        """The sheet of a setup, the first unless named."""
        return chladni_sheet(self.sheets[_place("setup", setup, [one.setup for one in self.sheets])])


@dataclass(frozen=True, eq=False, repr=False)
class CheckPlots(Plots):
    """What can be drawn before anything is sampled."""

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
    """The posteriors of a comparison by theory of the plate."""

    draws: Mapping[str, Draws]

    def corner(self, theory: str = "thin") -> Figure:
        """Every pair of moduli under one theory, by the package corner."""
        _place("theory", theory, list(self.draws))
        columns = {f"{name}, GPa": values * GPA for name, values in self.draws[theory].moduli.items()}
        return corner_figure(columns, labels=axis_labels(list(columns)))


def _figure(picture: Picture | None, place: str, wanted: str, got: str) -> Figure:
    """The figure of a picture; refused where there is none."""
    if picture is None:
        raise InputError(Fault(place, wanted, got))
    return picture.figure


def _place(what: str, name: str | None, names: Sequence[str]) -> int:
    """Index of a name among those that there are; the first if none is given."""
    if name is not None and name not in names:
        raise InputError(Fault(what, f"one of {', '.join(names)}", repr(name)))
    return 0 if name is None else list(names).index(name)


@dataclass(frozen=True, eq=False, repr=False)
class CampaignPlots(Plots):
    """The figures of a campaign, and of its diagnosis where there is one."""

    summary: CampaignSummary
    diagnosis: CampaignDiagnosis | None = None

    def shared(self, name: str | None = None) -> Figure:
        """A shared number, the first unless named: each board alone, the others, all boards."""
        names = list(self.summary.shared)
        return shared_picture(self.summary, names[_place("shared number", name, names)]).figure

    def boards(self) -> Figure:
        """The constants of all boards."""
        return boards_picture(self.summary).figure

    def common(self) -> Figure:
        """What is left over on all boards alike."""
        return common_picture(self.summary.common_residual).figure

    def left_out(self) -> Figure:
        """How much better the others predict each board that is left out."""
        if self.diagnosis is None or not self.diagnosis.left_out_boards:
            wanted, remedy = "a diagnosis that left boards out", "bayesplate.diagnose leaves them out"
            raise InputError(Fault("left_out", wanted, "a fit, or nothing shared", remedy))
        return left_out_picture(self.diagnosis).figure
