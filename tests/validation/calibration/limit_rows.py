"""The rows of the page of acceptance limits: what must hold, in what words, and which commands or tests measure it."""

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
    limit : str
    tests : tuple of str
        Tests that hold or do not, by file and the beginning of the name; others note what they measure
        (`limits.meets`).
    page : str
        Page of long runs on which its figures are.
    """

    check: str
    words: str
    limit: str
    tests: tuple[str, ...] = ()
    page: str = ""


COMPUTATION = (
    Row(
        "V1",
        "Posteriors known in closed form, noise known (normal) and unknown (Student's t)",
        "mean, standard deviation and 5, 50, 95 % quantiles within 4 Monte Carlo errors",
        tests=(
            "posterior/test_oracle.py::test_a_normal_posterior_is_recovered",
            "posterior/test_oracle.py::test_constants_of_unknown_noise",
            "posterior/test_oracle.py::test_other_normal",
            "posterior/test_oracle.py::test_fifty",
        ),
    ),
    Row(
        "V2",
        "The likelihood as it is used, rounding included, against quadrature",
        "as above; ln evidence within 0.02",
        tests=(
            "posterior/test_oracle.py::test_the_linear_law_with_rounded_readings",
            "posterior/test_oracle.py::test_the_evidence_from_draws",
        ),
    ),
    Row(
        "V3",
        "Wrong posteriors: standard deviation 1.15 times too large, a mode dropped, constants exchanged",
        "each found out",
        tests=("posterior/test_oracle.py::test_control",),
    ),
    Row(
        "V4",
        "Without readings the sampler returns the prior",
        "p of Kolmogorov and Smirnov above 0.01 for all parameters",
        tests=("posterior/test_prior_recovery.py::test_the_sampler_returns_the_prior",),
    ),
    Row(
        "V5",
        "Simulation-based calibration from the prior",
        "ranks inside the 95 % simultaneous band",
        page="calibration",
    ),
    Row(
        "V6",
        "Mutants of it: no likelihood, noise halved, Poisson's ratio negated, a mode counted twice",
        "each rejected at p < 0.001",
        page="calibration",
    ),
    Row(
        "V7",
        "Simulation-based calibration at the posteriors of the paper's two boards",
        "ranks inside the 95 % simultaneous band",
        page="calibration",
    ),
    Row("V8", "Coverage of intervals", "binomial 99 % of 50 and 90 %", page="calibration"),
    Row(
        "V9",
        "Geweke's joint test, 20 repeats of 2000 draws, 12 moments",
        "every z within 4, at most one beyond 3",
        page="calibration",
    ),
    Row(
        "V10", "Finite elements against closed forms and an independent Ritz solver", "0.5 cents; order of convergence"
    ),
    Row("V11", "The reduced law against full solves that it has not seen", "0.5 cents, and the error it states itself"),
    Row("V12", "Errors of modes left out by refitting against r / (1 - h)", "1e-9 where the law is linear"),
    Row(
        "V13",
        "What must not change: exchanged axes, scaled stiffness and mass, order of readings; readings given twice",
        "1e-10",
        tests=("posterior/test_target.py::test_the_order_of_the_modes",),
    ),
    Row(
        "V14",
        "The same seed gives the same bytes, whatever the number of threads or workers",
        "no file differs",
        tests=(
            "posterior/test_sampling.py::test_the_same_seed",
            "commands/test_resume.py::test_the_same_seed",
            "commands/test_batch.py::test_the_same_bytes",
            "commands/test_diagnose.py::test_the_same_seed",
        ),
    ),
)

CONVERGENCE = (
    Row(
        "ensembles",
        "Independent ensembles",
        "4, each from its own seed",
        tests=("posterior/test_sampling.py::test_two_ensembles_differ",),
    ),
    Row(
        "length",
        "Draws over autocorrelation time, every ensemble and parameter",
        "50 or more",
        tests=(
            "posterior/test_convergence.py::test_a_short_run",
            "posterior/test_convergence.py::test_the_burn_in_leaves",
            "posterior/test_convergence.py::test_each_limit_of_the_default_gate",
        ),
    ),
    Row(
        "r_hat",
        "Split R-hat over the ensembles",
        "1.01 or less",
        tests=(
            "posterior/test_convergence.py::test_a_stuck_ensemble",
            "posterior/test_convergence.py::test_ensembles_of_unlike_width",
            "posterior/test_convergence.py::test_a_drift",
            "posterior/test_convergence.py::test_rhat_is_not_taken",
        ),
    ),
    Row(
        "refusal",
        "A run that has not converged",
        "no posterior, exit code 5",
        tests=(
            "commands/test_resume.py::test_a_run_that_does_not_converge",
            "posterior/test_sampling.py::test_separate_peaks",
            "posterior/test_sampling.py::test_too_few_steps",
        ),
    ),
    Row(
        "normal case",
        "Draws of fits, weighted to the normal case of their boards, against its closed form",
        "within 4 Monte Carlo errors",
        tests=(
            "posterior/test_closed_form.py::test_right_draws",
            "posterior/test_closed_form.py::test_control",
            "posterior/test_sessions.py::test_draws_of_constants",
        ),
    ),
)

LONG_RUNS = (
    Row(
        "kill",
        "Runs killed at random moments and resumed",
        "final files identical to the byte",
        tests=(
            "commands/test_killed.py::test_killed_at_any_moment",
            "commands/test_resume.py::test_a_killed_fit",
            "posterior/test_checkpoint.py::test_kill_and_resume",
        ),
    ),
    Row(
        "interrupt",
        "Interrupted runs resumed",
        "exit code 130, then identical to the byte",
        tests=(
            "commands/test_resume.py::test_an_interrupted_fit",
            "commands/test_diagnose.py::test_an_interrupted_diagnosis",
            "campaign/test_fit.py::test_an_interrupted_campaign",
        ),
    ),
    Row(
        "damage",
        "Checkpoints cut off, altered, foreign or newer",
        "refused with the reason",
        tests=(
            "posterior/test_checkpoint.py::test_a_file_cut",
            "posterior/test_checkpoint.py::test_flipped_bits",
            "posterior/test_checkpoint.py::test_a_file_with_anything",
            "posterior/test_checkpoint.py::test_another_run",
            "posterior/test_checkpoint.py::test_a_newer_format",
        ),
    ),
    Row(
        "disk",
        "Full disks and folders that cannot be written",
        "what was there before stays",
        tests=("commands/test_full_disk.py::", "posterior/test_checkpoint.py::test_a_full_disk"),
    ),
    Row(
        "two_runs",
        "Two runs into one folder",
        "the second is refused and touches nothing",
        tests=(
            "commands/test_killed.py::test_a_folder_that_another_run_holds",
            "posterior/test_checkpoint.py::test_two_writers",
        ),
    ),
)

SECURITY = (
    Row(
        "pickle",
        "Pickled objects in the package or the wheel",
        "none",
        tests=(
            "commands/test_wheel.py::test_the_wheel_holds_nothing_else",
            "structure/test_imports.py::test_package_keeps_the_rules",
        ),
    ),
    Row(
        "html",
        "Markup in names, labels and notes",
        "none reaches a page unescaped",
        tests=(
            "report/test_texts_stay_texts.py::",
            "report/test_page.py::test_a_text_stays",
            "report/test_grading_page.py::test_names_and_messages",
            "campaign/test_page.py::test_a_text_stays",
        ),
    ),
    Row(
        "csv",
        "Spreadsheet formulas in tables",
        "none",
        tests=(
            "results/test_tables.py::test_a_text_stays_a_text_in_every_medium",
            "results/test_tables.py::test_a_text_that_is_not_escaped",
        ),
    ),
    Row(
        "terminal",
        "Control characters in messages",
        "none",
        tests=(
            "report/test_texts_stay_texts.py::test_a_title_stays",
            "report/test_texts_stay_texts.py::test_a_refused_name",
        ),
    ),
    Row(
        "paths",
        "Names that lead out of the output folder",
        "refused",
        tests=(
            "commands/test_batch.py::test_a_link_out",
            "commands/test_batch.py::test_names_of_boards_leave_no_folder",
        ),
    ),
    Row(
        "network",
        "Connections while any command runs",
        "none",
        tests=("commands/test_no_network.py::test_a_command_runs",),
    ),
    Row(
        "fuzz",
        "Cards, fragments and recordings, mutated",
        "accepted, or refused with a message",
        tests=("board/test_fuzz.py::", "recordings/test_fuzz.py::"),
    ),
    Row("lock", "Dependencies without a locked version", "none", tests=("structure/test_security.py::test_the_lock",)),
)

ROWS = {
    "Computation": COMPUTATION,
    "Convergence": CONVERGENCE,
    "Long runs": LONG_RUNS,
    "Security": SECURITY,
}
"""By the heading of the page."""
