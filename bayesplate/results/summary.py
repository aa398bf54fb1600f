"""summary.json as types: SI units, fields in the order of the file."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Literal

from bayesplate.estimates.leave_one_out import CarryingMode
from bayesplate.results.contract import Constants, Elastic, JointMoments, Rigidity, Spread
from bayesplate.results.modes import AssignedPeak, ModeRow, Spectrum
from bayesplate.results.tables import constants_table, render
from bayesplate.results.words import GPA, plus_minus

FORMAT = 1
TOO_FEW_MODES = "too few modes to leave one out"
ALL_MODES_CARRYING = "there is no leave-one-out error, for every mode alone carries a constant or a size"


@dataclass(frozen=True)
class ModelHeader:
    """The fitted model: plate theory, frequency law, declared effects, whether the noise is Student's, prior card.

    An isotropic board has one modulus E: in every draw E_x and E_y are E, and G_xy is E / (2 (1 + nu)).
    """

    theory: str
    law: str
    effects: tuple[str, ...]
    robust: bool
    prior: str
    isotropic: bool = False


@dataclass(frozen=True)
class SamplerHealth:
    """Convergence diagnostics of the sampler; None where a number does not exist, or not yet."""

    ensembles: int
    walkers: int
    steps: int
    tau_max: float | None
    rhat_max: float | None
    ess_min: float | None
    acceptance: float | None
    # the frequency law of the model, or its polynomial surrogate, whose draws are then weighted to the law
    drawn_from: Literal["law", "surrogate"] = "law"
    pareto_k: float | None = None  # Pareto k-hat of these weights


@dataclass(frozen=True)
class PointEstimate(Constants[float | None]):
    """Constants without an uncertainty; None where the estimate is no possible plate."""

    condition_number: float | None  # None where the readings are all of one mode


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
    """Posterior means under one frequency law; None where it has too few effective draws."""

    effective_draws: float


@dataclass(frozen=True)
class ErrorFigures:
    """Errors of the fit, cents."""

    in_sample_rms_cents: float  # of the residuals of `Summary.modes`: readings over posterior mean predictions
    # of each reading by the most likely constants of the others, without the modes of `Summary.carrying_modes`; None
    # where too few modes are left
    leave_one_out_rms_cents: float | None
    linearisation_rms_cents: float | None  # linear less exact law over the posterior
    exact_law_worst_cents: float  # exact law less full solves
    # surrogate_rms_cents, surrogate_worst_cents: surrogate less exact law over the posterior; None where the walkers
    # used no surrogate
    surrogate_rms_cents: float | None
    surrogate_worst_cents: float | None


@dataclass(frozen=True)
class RunHeader:
    """The header of a summary: board, seed, versions and model of a run."""

    format: int
    name: str  # of the board
    seed: int
    versions: Mapping[str, str]
    card_sha256: str
    model: ModelHeader


@dataclass(frozen=True)
class UnconvergedSummary(RunHeader):
    """The summary of a run that failed the convergence gate: its diagnostics, without constants."""

    converged: bool
    sampler: SamplerHealth
    warnings: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class Summary(RunHeader):
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
        Quantities that makers derive from the constants, by name.
    joint : JointMoments
        Joint moments of the logarithms of constants and density.
    least_squares : PointEstimate
        The paper's unweighted least squares.
    weighted_least_squares : PointEstimate
        Least squares of relative errors.
    percentile : Percentile or None
        None where there are too few or too many modes, or no estimate is positive.
    linear_means, exact_means : LawMeans
    modes : tuple of ModeRow
    peaks : tuple of AssignedPeak
        Peaks whose label is not sure, with the modes that they may be.
    spectra : tuple of Spectrum
        Of the setups with such peaks: all modes that the peaks may be.
    error : ErrorFigures
    sampler : SamplerHealth
    identifiability, warnings : tuple of str
    doubts : tuple of str
        The warnings that are reasons not to trust the constants.
    carrying_modes : tuple of CarryingMode
        Modes that alone carry a constant or a size; no leave-one-out error counts them.
    """

    converged: bool
    elastic: Elastic[Spread]
    rigidity: Rigidity[Spread]
    effects: Mapping[str, Mapping[str, Mapping[str, Spread]]]
    noise: Mapping[str, Spread]
    inputs: Mapping[str, Spread]
    derived: Mapping[str, Spread]
    joint: JointMoments
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
        """Why there is no leave-one-out error, if there is none."""
        are_left_out = any(mode.left_out_cents is not None for mode in self.modes)
        return ALL_MODES_CARRYING if are_left_out else TOO_FEW_MODES

    def __repr__(self) -> str:
        constants = ", ".join(f"{name} = {plus_minus(entry, GPA)} GPa" for name, entry in self.elastic.items())
        return f"<Summary of {self.name}: {constants}; {len(self.modes)} modes, {self.model.law} law>"

    def _repr_html_(self) -> str:
        """The constants as an HTML table for notebooks."""
        table = constants_table(f"{self.name}, GPa", self.elastic, isotropic=self.model.isotropic)
        return render(table, "html")


PACKAGES = ("bayesplate", "numpy", "scipy", "emcee", "scikit-fem", "arviz")


def versions() -> dict[str, str]:
    """Versions of Python and of the packages on which the numbers depend."""
    installed = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            installed[package] = version(package)
        except PackageNotFoundError:
            installed[package] = "unknown"
    return installed
