"""One fit, from a problem to draws, a summary and files, with the law that serves; and the run that it is part of."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from bayesplate.board.board import Board
from bayesplate.commands.printout import Printout, show_fit
from bayesplate.commands.problem import Problem, pose_all
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.errors import CheckpointError, NotConvergedError
from bayesplate.files import catch_write_errors, make_folder, write_text
from bayesplate.posterior.assessment import assess
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference, infer
from bayesplate.posterior.likely_labels import with_likely_labels
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.reweighting import linear_is_enough, linearisation
from bayesplate.posterior.sampling import Progress, SamplerSettings
from bayesplate.report.plots import FitPlots
from bayesplate.results.archive import archive_attributes, posterior_tree, to_arviz, write_tree
from bayesplate.results.contract import json_text
from bayesplate.results.folder import ARCHIVE_FILE, PAGE_FILE, SUMMARY_FILE, OutputFolder
from bayesplate.results.summarise import summarise, unconverged_summary
from bayesplate.results.summary import Summary, versions

FIT_TIME = 3.0
"""Time of a fit, relative to the other stages of a run."""


@dataclass(frozen=True, eq=False, repr=False)
class FitResult:
    """A converged fit, and where its files are.

    Attributes
    ----------
    problem : Problem
    draws : Draws
        The thinned posterior by name.
    summary : Summary
        What summary.json holds: constants, modes, errors, the sampler's health.
    folder : Path or None
        Where its files are, of a fit by itself; None without files, and for one of several fits.
    """

    problem: Problem
    draws: Draws
    summary: Summary
    folder: Path | None = None

    @property
    def inference(self) -> Inference:
        """Chains and the verdict of the convergence gate."""
        return self.draws.inference

    @cached_property
    def plot(self) -> FitPlots:
        """The figures: `result.plot.constants()`."""
        return FitPlots(self.draws, self.summary)

    @cached_property
    def tree(self) -> Any:
        """The draws as posterior.nc holds them: an xarray.DataTree."""
        attributes = archive_attributes(self.draws.problem.prior, self.summary, self.problem.prepared.card.text)
        return posterior_tree(self.draws, attributes)

    def to_arviz(self) -> Any:
        """The draws as ArviZ works with them: InferenceData in ArviZ 0.23, DataTree in 1.x; as in posterior.nc.

        Returns
        -------
        arviz.InferenceData or xarray.DataTree
        """
        return to_arviz(self.tree)

    def write(self, folder: Path) -> None:
        """Write posterior.nc and summary.json.

        Raises
        ------
        UnwritableError
            If the disk is full or the place is not ours.
        """
        make_folder(folder)
        write_tree(folder / ARCHIVE_FILE, self.tree)
        write_text(folder / SUMMARY_FILE, json_text(self.summary))

    def write_page(self, folder: Path, diagnosis: Diagnosis | None = None) -> None:
        """Write report.html, its figures and tables; with a diagnosis its verdict too. Raises as `write`."""
        from bayesplate.report.page import write_report

        with catch_write_errors(folder / PAGE_FILE):
            write_report(folder, self.problem.prepared.card, self.draws, self.summary, diagnosis)

    def __repr__(self) -> str:
        return repr(self.summary).replace("<Summary", "<FitResult", 1)

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_fit(self.summary)

    def _repr_html_(self) -> str:
        return self.printout().html(self.problem.board.title or self.summary.name)


@dataclass
class Stages:
    """The progress of a run of several stages: reports each stage, and the share that is done, which never falls."""

    tell: Callable[[Progress], None] | None
    remaining_time: float  # relative time of the stages that have not begun
    _stage: str = ""
    _past: float = 0.0
    _length: float = 0.0
    _done: float = 0.0

    def begin(self, stage: str, length: float) -> None:
        """Begin the next stage, of a relative length."""
        self._past += self._length
        self._stage, self._length = stage, length
        self.remaining_time = max(self.remaining_time - length, 0.0)
        self.reached(0.0)

    def sampled(self, progress: Progress) -> None:
        """Report sampling within the stage."""
        self.reached(progress.sampled, progress)

    def reached(self, share: float, progress: Progress | None = None) -> None:
        """Report that a share of the stage is done."""
        total = self._past + self._length + self.remaining_time
        self._done = max(self._done, (self._past + share * self._length) / total)
        if self.tell is not None:
            self.tell(replace(progress or Progress(0, 0), stage=self._stage, done=self._done))


class Run:
    """A run of one fit or several: its seed, its progress, and its output folder; without `out` nothing is written."""

    def __init__(
        self,
        seed: int = 1,
        out: str | os.PathLike[str] | None = None,
        *,
        force: bool = False,
        resume: bool = False,
        progress: Callable[[Progress], None] | None = None,
    ) -> None:
        self.seed, self.stages = seed, Stages(progress, 0.0)
        self.folder = None if out is None else OutputFolder(Path(out))
        self._force, self._resume = force, resume

    @property
    def path(self) -> Path | None:
        """Where the files go; None if nothing is to be written."""
        return None if self.folder is None else self.folder.path

    def open(self, first: Mapping[str, Problem], remaining_time: float = 0.0) -> None:
        """Pose the problems fitted first, by place in the checkpoint, and open the folder.

        `remaining_time` is as of `Stages`. Raises InputError, NotIdentifiableError or CheckpointError; every refusal
        comes before a file is written.
        """
        self.stages.remaining_time = remaining_time
        if self.folder is not None:
            self.folder.require_usable(force=self._force, resume=self._resume)
        pose_all(list(first.values()))
        for problem in first.values():
            SamplerSettings(seed=self.seed).walkers(problem.posed.parameters.n_dim)
        if self.folder is not None:
            saved = (law_checkpoint(self.folder.checkpoint / place, one, one.posed) for place, one in first.items())
            if self._resume and not any(checkpoint.exists() for checkpoint in saved):
                laws = " or ".join(dict.fromkeys(problem.posed.posterior.law for problem in first.values()))
                wanted = f"a saved run of this command under the {laws} law"
                raise CheckpointError(f"{self.path}: wanted {wanted}, got none to resume (--force runs it anew)")
            self.folder.open(resume=self._resume)

    def fit(
        self, problem: Problem, place: str = "", stage: str = "", *, subject: str = "", tells_failure: bool = False
    ) -> FitResult:
        """Fit one problem; see `compute_fit`. Without a `stage` the progress of the sampler alone is reported."""
        if stage:
            self.stages.begin(stage, FIT_TIME)
        checkpoints = None if self.folder is None else self.folder.checkpoint / place
        progress = self.stages.sampled if stage else self.stages.tell
        failure = self.path if tells_failure else None
        return compute_fit(problem, self.seed, checkpoints, progress, subject=subject, failure=failure)


def fit_problem(problem: Problem, run: Run, *, report: bool) -> FitResult:
    """The whole run of one fit; `bayesplate.fit` says what is raised."""
    run.open({"": problem})
    result = replace(run.fit(problem, tells_failure=True), folder=run.path)
    if run.folder is not None:
        result.write(run.folder.path)
        if report:
            result.write_page(run.folder.path)
        run.folder.close()
    return result


def with_board(problem: Problem, board: Board) -> Problem:
    """The same card with another model of the board: one more effect, or two labels exchanged."""
    return replace(problem, prepared=replace(problem.prepared, board=board))


def compute_fit(
    problem: Problem,
    seed: int,
    checkpoints: Path | None = None,  # one subfolder per law
    progress: Callable[[Progress], None] | None = None,
    *,
    subject: str = "",  # what is fitted, for the error of a run that fits more than one board
    failure: Path | None = None,  # where summary.json says that the sampler did not converge
) -> FitResult:
    """Sample a problem, and once more under the exact law if the draws show that the linear one does not serve."""

    def sample(posed: PosedProblem) -> Draws:
        checkpoint = None if checkpoints is None else law_checkpoint(checkpoints, problem, posed)
        inference = infer(posed, SamplerSettings(seed=seed), checkpoint=checkpoint, progress=progress)
        convergence = inference.convergence
        if not convergence.passed:
            if failure is not None:
                failed_summary = unconverged_summary(
                    inference.problem,
                    inference.chains,
                    convergence,
                    seed,
                    versions(),
                    problem.prepared.card.sha256,
                )
                write_text(failure / SUMMARY_FILE, json_text(failed_summary))
            raise convergence_error(convergence, inference.problem.doubts, subject=subject)
        return with_likely_labels(inference, seed)

    draws = sample(problem.posed)
    errors = linearisation(draws)
    is_linear = problem.law == "linear"
    if problem.asked_law is None and is_linear and not linear_is_enough(draws, errors):
        # The law was chosen by a normal approximation, which the draws correct.
        draws = sample(problem.posed.under("exact"))
        errors = linearisation(draws)
    assessment = assess(draws, errors)
    summary = summarise(draws, assessment, seed, versions(), problem.prepared.card.sha256)
    return FitResult(problem, draws, summary)


def convergence_error(
    convergence: Convergence,
    doubts: Sequence[str] = (),
    *,
    subject: str = "",
    consequence: str = "no constants are given",
) -> NotConvergedError:
    """The error of draws that failed the gate, with its consequence and likely causes."""
    head = f"the sampler did not converge{f' for {subject}' if subject else ''}, so {consequence}:"
    return NotConvergedError("\n".join((head, *convergence.reasons, *(f"A likely cause: {doubt}" for doubt in doubts))))


def law_checkpoint(folder: Path, problem: Problem, posed: PosedProblem) -> Checkpoint:
    """The checkpoint of a problem under the law of a posing."""
    return Checkpoint(folder / posed.posterior.law, fingerprint(problem, posed))


def fingerprint(problem: Problem, posed: PosedProblem) -> str:
    """Hash of everything besides the sampler's settings that decides the draws."""
    prior = {name: repr(density) for name, density in posed.prior.constants.items()}
    identity = {
        "card": problem.prepared.card.sha256,
        "prior": prior,
        "noise": [repr(setup.noise) for setup in posed.board.setups],
        "parameters": [repr(parameter) for parameter in posed.board.parameters],
        "effects": list(posed.board.effects),
        "forms": [repr(effect) for effect in posed.board.effect_forms],
        "readings": [repr(setup.readings) for setup in posed.board.setups],
        "peaks": [repr((setup.peaks, setup.missed, setup.spurious)) for setup in posed.board.setups],
        "attached": [repr(setup.attached) for setup in posed.board.setups],
        "law": posed.posterior.law,
        "law_alone": posed.is_forced,
        "robust": posed.posterior.robust,
        "versions": versions(),
    }
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
