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

Where things are
----------------
board           what lies on the bench, and its card
plate           how it rings: energies, and their eigenvalues (`plate.solve`)
effects         what an ideal plate lacks, one file for each effect; CONTRIBUTING.md adds one
frequencies     from constants to frequencies (`frequencies.model`), errors of readings (`frequencies.reading_errors`)
estimates       least squares, the paper's methods (`estimates.percentile`), warnings
posterior       the likelihood and the priors (`posterior.target`), the draws of emcee (`posterior.sampling`)
results         the summary of the draws, tables, files
grading         many boards side by side
diagnosis       from a residual to an effect: the verdict (`diagnosis.verdict`), the claim (`diagnosis.claim`)
campaign        what several boards share
planning        what to measure next
recordings      hits, taps and sweeps to frequencies
report          figures and pages
commands        one file for each of the functions above, and what they share

A room imports only rooms before it (recordings only the plate), and its docstring is a map of its files. `cli`,
`asking` and `terminal` are the command line; the other files beside the rooms serve all of them.

Glossary of symbols
-------------------
x, y            along and across the grain
L_x, L_y, h     side lengths and thickness, m
rho             density, kg m^-3
E_x, E_y        Young's moduli along and across the grain, Pa
G_xy            in-plane shear modulus, Pa
nu_xy, nu_yx    Poisson ratios, E_x nu_yx = E_y nu_xy
D_x, D_y, D_s   rigidities, N m: D_x = E_x h^3 / (12 (1 - nu_xy nu_yx)), D_y likewise, D_s = G_xy h^3 / 3
(m,n)           label of a mode: interior nodal lines crossed along x and along y, counted from the setup's first label
a, b, c         the paper's modal coefficients: omega^2 = lambda (a D_x + b D_y + c D_s)
lambda          1 / (rho h L_x^2 L_y^2)
psi             omega^2 / lambda of a measured frequency, N m
tau             integrated autocorrelation time of the sampler, steps
cents           1200 log2 of a frequency ratio
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

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
"""Where each public name is defined; a type checker, which cannot follow it, reads the imports below."""

if TYPE_CHECKING:
    from bayesplate.board.attached import AttachedItem as AttachedItem
    from bayesplate.board.attached import DeclaredFluid as DeclaredFluid
    from bayesplate.board.board import Board as Board
    from bayesplate.board.prior import PriorCard as PriorCard
    from bayesplate.board.quantity import Quantity as Quantity
    from bayesplate.board.reading import Peak as Peak
    from bayesplate.board.reading import Reading as Reading
    from bayesplate.board.setup import Setup as Setup
    from bayesplate.campaign.diagnosis import CampaignDiagnosis as CampaignDiagnosis
    from bayesplate.campaign.summary import CampaignCheck as CampaignCheck
    from bayesplate.campaign.summary import CampaignSummary as CampaignSummary
    from bayesplate.commands.batch import BatchResult as BatchResult
    from bayesplate.commands.batch import batch as batch
    from bayesplate.commands.campaign import Campaign as Campaign
    from bayesplate.commands.campaign_diagnose import CampaignDiagnoseResult as CampaignDiagnoseResult
    from bayesplate.commands.campaign_fit import CampaignFitResult as CampaignFitResult
    from bayesplate.commands.check import CheckResult as CheckResult
    from bayesplate.commands.check import check as check
    from bayesplate.commands.cite import cite as cite
    from bayesplate.commands.compare import CompareResult as CompareResult
    from bayesplate.commands.compare import compare as compare
    from bayesplate.commands.diagnose import DiagnoseResult as DiagnoseResult
    from bayesplate.commands.diagnose import diagnose as diagnose
    from bayesplate.commands.fit import fit as fit
    from bayesplate.commands.fit_board import FitRequest as FitRequest
    from bayesplate.commands.fit_board import fit_board as fit_board
    from bayesplate.commands.fitting import FitResult as FitResult
    from bayesplate.commands.modes import ModesResult as ModesResult
    from bayesplate.commands.modes import modes as modes
    from bayesplate.commands.new import new as new
    from bayesplate.commands.pick import PickResult as PickResult
    from bayesplate.commands.pick import pick as pick
    from bayesplate.commands.plan import PlanResult as PlanResult
    from bayesplate.commands.plan import plan as plan
    from bayesplate.commands.problem import Problem as Problem
    from bayesplate.diagnosis.result import Diagnosis as Diagnosis
    from bayesplate.errors import BatchError as BatchError
    from bayesplate.errors import BayesplateError as BayesplateError
    from bayesplate.errors import CheckpointError as CheckpointError
    from bayesplate.errors import Fault as Fault
    from bayesplate.errors import InputError as InputError
    from bayesplate.errors import NotConvergedError as NotConvergedError
    from bayesplate.errors import NotIdentifiableError as NotIdentifiableError
    from bayesplate.grading.matching import Grading as Grading
    from bayesplate.grading.matching import GradingRequest as GradingRequest
    from bayesplate.labels import Label as Label
    from bayesplate.planning.plan import Plan as Plan
    from bayesplate.recordings.contract import PickReport as PickReport
    from bayesplate.results.checking import CheckReport as CheckReport
    from bayesplate.results.comparison import Comparison as Comparison
    from bayesplate.results.sheets import ModesReport as ModesReport
    from bayesplate.results.summary import Summary as Summary
else:
    __all__ = sorted(_HOMES)


def __getattr__(name: str) -> object:
    """Import a public name when it is first used, so that `import bayesplate` costs nothing."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'bayesplate' has no attribute {name!r}")
