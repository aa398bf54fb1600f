"""The rows of the page of bars: what must hold, in what words, and which commands or tests measure it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One thing that must hold.

    Attributes
    ----------
    check : str
        Key, under which tests note what they measure.
    words : str
        What is compared with what.
    bar : str
    """

    check: str
    words: str
    bar: str


COMPUTATION = (
    Row("V1", "Posteriors known in closed form, noise known (normal) and unknown (Student's t)",
        "mean, standard deviation and 5, 50, 95 % quantiles within 4 Monte Carlo errors"),
    Row("V2", "The likelihood as it is used, rounding included, against quadrature",
        "as above; ln evidence within 0.02"),
    Row("V3", "Wrong posteriors: standard deviation 1.15 times too large, a mode dropped, constants exchanged",
        "each found out"),
    Row("V4", "Without readings the sampler returns the prior",
        "Kolmogorov and Smirnov's p, all parameters: above 0.01"),
    Row("V5", "Simulation-based calibration from the prior, 1000 simulations",
        "ranks inside the 95 % simultaneous band"),
    Row("V6", "Mutants of it: no likelihood, noise halved, Poisson's ratio negated, a mode counted twice",
        "each rejected at p < 0.001"),
    Row("V7", "Simulation-based calibration at the posteriors of the paper's two boards, 500 simulations each",
        "ranks inside the 95 % simultaneous band"),
    Row("V8", "Coverage of intervals", "binomial 99 % of 50 and 90 %"),
    Row("V9", "Geweke's joint test, 20 repeats of 2000 draws, 12 moments", "every z within 4, at most one beyond 3"),
    Row("V10", "Finite elements against closed forms and an independent Ritz solver",
        "0.5 cents; order of convergence"),
    Row("V11", "The reduced law against full solves that it has not seen", "0.5 cents, and the error it states itself"),
    Row("V12", "Errors of modes left out by refitting against r / (1 - h)", "1e-9 where the law is linear"),
    Row("V13", "What must not change: exchanged axes, scaled stiffness and mass, order of readings", "1e-10"),
    Row("V14", "The same seed gives the same bytes, whatever the number of threads or workers", "no file differs"),
)  # fmt: skip

CONVERGENCE = (
    Row("ensembles", "Independent ensembles", "4, each from its own seed"),
    Row("length", "Draws over autocorrelation time, every ensemble and parameter", "50 or more"),
    Row("r_hat", "Split R-hat over the ensembles", "1.01 or less"),
    Row("refusal", "A run that has not converged", "no posterior, exit code 5"),
    Row("certificate", "Draws against the closed form on the user's own data, where there is one",
        "within 4 Monte Carlo errors"),
)  # fmt: skip

LONG_RUNS = (
    Row("kill", "Runs killed at random moments and resumed", "final files identical to the byte"),
    Row("interrupt", "Interrupted runs resumed", "exit code 130, then identical to the byte"),
    Row(
        "damage", "Checkpoints cut off, altered, foreign or newer", "refused with the reason, or the one before is used"
    ),
    Row("disk", "Full disks and folders that cannot be written", "what was there before stays"),
    Row("two_runs", "Two runs into one folder", "the second is refused and touches nothing"),
)

SECURITY = (
    Row("pickle", "Pickled objects in the package or the wheel", "none"),
    Row("html", "Markup in names, labels and notes", "none reaches a page unescaped"),
    Row("csv", "Spreadsheet formulas in tables", "none"),
    Row("terminal", "Control characters in messages", "none"),
    Row("paths", "Names that lead out of the output folder", "refused"),
    Row("network", "Connections while any command runs", "none"),
    Row("fuzz", "Cards, fragments and recordings, mutated", "accepted, or refused with a message"),
    Row("lock", "Dependencies without a locked version", "none"),
)

ROWS = {
    "Computation": COMPUTATION,
    "Convergence": CONVERGENCE,
    "Long runs": LONG_RUNS,
    "Security": SECURITY,
}
"""By the heading of the page."""
