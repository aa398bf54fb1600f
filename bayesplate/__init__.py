"""Elastic constants of a rectangular orthotropic plate from its modal frequencies, with an honest uncertainty.

    fit(card)        a board to the posterior of its constants
    diagnose(card)   the fit, what its residual points to, and the error before and after
    compare(card)    every method side by side
    check(card)      what a card can identify, without sampling
    plan(card)       what to measure next, by what it is expected to give
    modes(card)      the lowest modes and their Chladni figures
    cite(card)       references of exactly what a fit uses
    pick(files)      recordings of hits, taps or sweeps to frequencies
    batch(folder)    many boards to one table, on all cores or on a cluster
    new(path)        a first card, to be completed

`card` is the name of a shipped board, the path of a card, a `Board` made from numbers, or a `Problem`, which has the
densities and the frequencies that other samplers ask for; `fit`, `check`, `diagnose` and `plan` take a `Campaign` or
its card too. Nothing is written unless `out=` names a folder.

Glossary of symbols
-------------------
x, y            along and across the grain
L_x, L_y, h     side lengths and thickness, m
rho             density, kg m^-3
E_x, E_y        Young's moduli along and across the grain, Pa
G_xy            in-plane shear modulus, Pa
nu_xy, nu_yx    Poisson ratios, E_x nu_yx = E_y nu_xy
D_x, D_y, D_s   rigidities, N m: D_x = E_x h^3 / (12 (1 - nu_xy nu_yx)), D_y likewise, D_s = G_xy h^3 / 3
(m,n)           label of a mode: interior nodal lines crossed along x and along y, plus the laboratory's first label
a, b, c         the paper's modal coefficients: omega^2 = lambda (a D_x + b D_y + c D_s)
lambda          1 / (rho h L_x^2 L_y^2)
psi             omega^2 / lambda of a measured frequency, N m
tau             integrated autocorrelation time of the sampler, steps
cents           1200 log2 of a frequency ratio
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bayesplate.board.attached import AttachedItem, DeclaredFluid
    from bayesplate.board.board import Board
    from bayesplate.board.prior import PriorCard
    from bayesplate.board.quantity import Quantity
    from bayesplate.board.reading import Peak, Reading
    from bayesplate.board.setup import Setup
    from bayesplate.campaign.diagnosis import CampaignDiagnosis
    from bayesplate.campaign.summary import CampaignCheck, CampaignSummary
    from bayesplate.commands.batch import BatchResult, batch
    from bayesplate.commands.campaign import Campaign
    from bayesplate.commands.campaign_diagnose import CampaignDiagnoseResult
    from bayesplate.commands.campaign_fit import CampaignFitResult
    from bayesplate.commands.check import CheckResult, check
    from bayesplate.commands.cite import cite
    from bayesplate.commands.compare import CompareResult, compare
    from bayesplate.commands.diagnose import DiagnoseResult, diagnose
    from bayesplate.commands.fit import fit
    from bayesplate.commands.fit_board import FitRequest, fit_board
    from bayesplate.commands.fitting import FitResult
    from bayesplate.commands.modes import ModesResult, modes
    from bayesplate.commands.new import new
    from bayesplate.commands.pick import PickResult, pick
    from bayesplate.commands.plan import PlanResult, plan
    from bayesplate.commands.problem import Problem
    from bayesplate.diagnosis.result import Diagnosis
    from bayesplate.errors import (
        BatchError,
        BayesplateError,
        CheckpointError,
        Fault,
        InputError,
        NotConvergedError,
        NotIdentifiableError,
    )
    from bayesplate.grading.matching import Grading, GradingRequest
    from bayesplate.labels import Label
    from bayesplate.planning.plan import Plan
    from bayesplate.recordings.contract import PickReport
    from bayesplate.results.checking import CheckReport
    from bayesplate.results.comparison import Comparison
    from bayesplate.results.sheets import ModesReport
    from bayesplate.results.summary import Summary

__all__ = [
    "AttachedItem",
    "BatchError",
    "BatchResult",
    "BayesplateError",
    "Board",
    "Campaign",
    "CampaignCheck",
    "CampaignDiagnoseResult",
    "CampaignDiagnosis",
    "CampaignFitResult",
    "CampaignSummary",
    "CheckReport",
    "CheckResult",
    "CheckpointError",
    "CompareResult",
    "Comparison",
    "DeclaredFluid",
    "DiagnoseResult",
    "Diagnosis",
    "Fault",
    "FitRequest",
    "FitResult",
    "Grading",
    "GradingRequest",
    "InputError",
    "Label",
    "ModesReport",
    "ModesResult",
    "NotConvergedError",
    "NotIdentifiableError",
    "Peak",
    "PickReport",
    "PickResult",
    "Plan",
    "PlanResult",
    "PriorCard",
    "Problem",
    "Quantity",
    "Reading",
    "Setup",
    "Summary",
    "batch",
    "check",
    "cite",
    "compare",
    "diagnose",
    "fit",
    "fit_board",
    "modes",
    "new",
    "pick",
    "plan",
]

_HOMES = {
    "AttachedItem": "bayesplate.board.attached",
    "BatchError": "bayesplate.errors",
    "BatchResult": "bayesplate.commands.batch",
    "BayesplateError": "bayesplate.errors",
    "Board": "bayesplate.board.board",
    "Campaign": "bayesplate.commands.campaign",
    "CampaignCheck": "bayesplate.campaign.summary",
    "CampaignDiagnoseResult": "bayesplate.commands.campaign_diagnose",
    "CampaignDiagnosis": "bayesplate.campaign.diagnosis",
    "CampaignFitResult": "bayesplate.commands.campaign_fit",
    "CampaignSummary": "bayesplate.campaign.summary",
    "CheckReport": "bayesplate.results.checking",
    "CheckResult": "bayesplate.commands.check",
    "CheckpointError": "bayesplate.errors",
    "CompareResult": "bayesplate.commands.compare",
    "Comparison": "bayesplate.results.comparison",
    "DeclaredFluid": "bayesplate.board.attached",
    "DiagnoseResult": "bayesplate.commands.diagnose",
    "Diagnosis": "bayesplate.diagnosis.result",
    "Fault": "bayesplate.errors",
    "FitRequest": "bayesplate.commands.fit_board",
    "FitResult": "bayesplate.commands.fitting",
    "Grading": "bayesplate.grading.matching",
    "GradingRequest": "bayesplate.grading.matching",
    "InputError": "bayesplate.errors",
    "Label": "bayesplate.labels",
    "ModesReport": "bayesplate.results.sheets",
    "ModesResult": "bayesplate.commands.modes",
    "NotConvergedError": "bayesplate.errors",
    "NotIdentifiableError": "bayesplate.errors",
    "Peak": "bayesplate.board.reading",
    "PickReport": "bayesplate.recordings.contract",
    "PickResult": "bayesplate.commands.pick",
    "Plan": "bayesplate.planning.plan",
    "PlanResult": "bayesplate.commands.plan",
    "PriorCard": "bayesplate.board.prior",
    "Problem": "bayesplate.commands.problem",
    "Quantity": "bayesplate.board.quantity",
    "Reading": "bayesplate.board.reading",
    "Setup": "bayesplate.board.setup",
    "Summary": "bayesplate.results.summary",
    "batch": "bayesplate.commands.batch",
    "check": "bayesplate.commands.check",
    "cite": "bayesplate.commands.cite",
    "compare": "bayesplate.commands.compare",
    "diagnose": "bayesplate.commands.diagnose",
    "fit": "bayesplate.commands.fit",
    "fit_board": "bayesplate.commands.fit_board",
    "modes": "bayesplate.commands.modes",
    "new": "bayesplate.commands.new",
    "pick": "bayesplate.commands.pick",
    "plan": "bayesplate.commands.plan",
}
"""Where each name is defined."""


def __getattr__(name: str) -> object:
    """Import a public name when it is first used, so that `import bayesplate` costs nothing."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'bayesplate' has no attribute {name!r}")
