"""summary.json as types: everything a reader of a fit needs, in SI units, fields in the order of the file."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Literal

from bayesplate.estimates.leave_one_out import CarryingMode
from bayesplate.results.contract import Constants, Elastic, Joint, Rigidity, Spread
from bayesplate.results.modes import AssignedPeak, ModeRow, Spectrum
from bayesplate.results.tables import constants_table, render
from bayesplate.results.words import GPA, plus_minus

FORMAT = 1
TOO_FEW_LEFT = "too few modes to leave one out"
NONE_JUDGED = "there is no left-out error, for every mode alone carries a constant or a size"


@dataclass(frozen=True)
class ModelHeader:
    """What was fitted: plate theory, frequency law, declared effects, whether the noise is Student's, prior card.

    Of an isotropic board one modulus: E_x and E_y are E in every draw, and G_xy is E / (2 (1 + nu)).
    """

    theory: str
    law: str
    effects: tuple[str, ...]
    robust: bool
    prior: str
    isotropic: bool = False


@dataclass(frozen=True)
class SamplerHealth:
    """How the sampler fared; None where a number does not exist, or not yet."""

    ensembles: int
    walkers: int
    steps: int
    tau_max: float | None
    rhat_max: float | None
    ess_min: float | None
    acceptance: float | None
    # the law of the model, or a polynomial in its place whose draws are weighted to it
    drawn_from: Literal["law", "surrogate"] = "law"
    pareto_k: float | None = None  # k-hat of these weights


@dataclass(frozen=True)
class PointEstimate(Constants[float | None]):
    """Constants without an uncertainty; None where the estimate is no plate's."""

    condition_number: float


@dataclass(frozen=True)
class PercentileValue:
    """Mean (Pa) and spread (per cent) of the trimmed estimates of one modulus."""

    mean: float | None
    sd_percent: float | None


@dataclass(frozen=True)
class Percentile(Elastic[PercentileValue]):
    """The paper's percentile method."""

    n_subsets: int


@dataclass(frozen=True)
class LawMeans(Constants[float | None]):
    """Posterior means under one frequency law; None where too few draws stand for it."""

    effective_draws: float


@dataclass(frozen=True)
class ErrorFigures:
    """Errors of the fit, cents."""

    in_sample_rms_cents: float  # of the residuals of `Summary.modes`: readings over posterior mean predictions
    # of each reading by the most likely constants of the others, those of `Summary.carrying_modes` not counted; None
    # where too few are left, or none
    leave_one_out_rms_cents: float | None
    linearisation_rms_cents: float | None  # linear less exact law over the posterior
    exact_law_worst_cents: float  # exact law against full solves
    # surrogate_rms_cents, surrogate_worst_cents: surrogate of the exact law less that law over the posterior; None
    # where the walkers walked on none
    surrogate_rms_cents: float | None
    surrogate_worst_cents: float | None


@dataclass(frozen=True)
class Run:
    """What was run, before any result."""

    format: int
    name: str  # of the board
    seed: int
    versions: Mapping[str, str]
    card_sha256: str
    model: ModelHeader


@dataclass(frozen=True)
class Unconverged(Run):
    """The summary of a run that failed the convergence gate: its diagnostics, and no constants."""

    converged: bool
    sampler: SamplerHealth
    warnings: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class Summary(Run):
    """The summary of a converged fit: `summary.elastic.E_x.mean` is a number in Pa.

    Attributes
    ----------
    converged : bool
    elastic : Elastic of Spread, Pa
        E_x, E_y, G_xy.
    rigidity : Rigidity of Spread, N m
        D_x, D_y, D_s.
    effects : dict of dict of dict of Spread
        Parameters of the declared effects by board or setup, effect and name.
    noise : dict of Spread
        Relative, by setup.
    inputs : dict of Spread
        Uncertain inputs of the card, by name.
    derived : dict of Spread
        What makers derive from the constants, by name.
    joint : Joint
        How the constants and the density vary together.
    least_squares : PointEstimate
        The paper's.
    weighted_least_squares : PointEstimate
        That of relative errors.
    percentile : Percentile or None
        None where there are too few or too many modes, or no estimate is positive.
    linear_means, exact_means : LawMeans
    modes : tuple of ModeRow
    peaks : tuple of AssignedPeak
        Those whose label is not sure, with the modes that they may be.
    spectra : tuple of Spectrum
        Of the setups that have such peaks: all modes that they may be.
    error : ErrorFigures
    sampler : SamplerHealth
    identifiability, warnings : tuple of str
    doubts : tuple of str
        Those of the warnings that are reasons not to trust the constants.
    carrying_modes : tuple of CarryingMode
        Modes that alone carry a constant or a size: they count in no error of modes left out.
    """

    converged: bool
    elastic: Elastic[Spread]
    rigidity: Rigidity[Spread]
    effects: Mapping[str, Mapping[str, Mapping[str, Spread]]]
    noise: Mapping[str, Spread]
    inputs: Mapping[str, Spread]
    derived: Mapping[str, Spread]
    joint: Joint
    least_squares: PointEstimate
    weighted_least_squares: PointEstimate
    percentile: Percentile | None
    linear_means: LawMeans
    exact_means: LawMeans
    modes: tuple[ModeRow, ...]
    peaks: tuple[AssignedPeak, ...]
    spectra: tuple[Spectrum, ...]
    error: ErrorFigures
    sampler: SamplerHealth
    identifiability: tuple[str, ...]
    warnings: tuple[str, ...]
    doubts: tuple[str, ...] = ()
    carrying_modes: tuple[CarryingMode, ...] = ()

    @property
    def why_no_left_out(self) -> str:
        """Why there is no error of modes left out, where there is none."""
        are_left_out = any(one.left_out_cents is not None for one in self.modes)
        return NONE_JUDGED if are_left_out else TOO_FEW_LEFT

    def __repr__(self) -> str:
        constants = ", ".join(f"{name} = {plus_minus(entry, GPA)} GPa" for name, entry in self.elastic.items())
        return f"<Summary of {self.name}: {constants}; {len(self.modes)} modes, {self.model.law} law>"

    def _repr_html_(self) -> str:
        """The constants as a notebook shows them."""
        table = constants_table(f"{self.name}, GPa", self.elastic, isotropic=self.model.isotropic)
        return render(table, "html")


PACKAGES = ("bayesplate", "numpy", "scipy", "emcee", "scikit-fem")


def versions() -> dict[str, str]:
    """Version of Python and of every package that has a part in the numbers."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found
