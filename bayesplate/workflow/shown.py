"""What a command prints: its tables, its sentences, its JSON; the command line only lays them out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bayesplate.diagnosis.wording.diagnosis import Diagnosis
from bayesplate.diagnosis.wording.tables import candidates_table, errors_table, shift_table
from bayesplate.diagnosis.wording.told import verdict_sentence
from bayesplate.posterior.sampling import Progress
from bayesplate.results.comparison_tables import METHODS_REMARK, forward_table, methods_table, sheet_table
from bayesplate.results.folder import json_text
from bayesplate.results.tables import Table, check_tables, constants_table, modes_table, unlabelled_table

__all__ = [
    "Progress",
    "Shown",
    "Table",
    "json_text",
    "progress_text",
    "show_check",
    "show_compare",
    "show_diagnosis",
    "show_fit",
    "show_modes",
]


@dataclass(frozen=True)
class Shown:
    """What is printed: tables, what the data tell weakly, warnings, and a closing sentence."""

    tables: tuple[Table, ...]
    remarks: tuple[str, ...]
    warnings: tuple[str, ...]
    closing: str


def show_check(report: Mapping[str, Any]) -> Shown:
    """The report of `bayesplate.workflow.check.check` for a person."""
    closing = f"{report['law']} law; nothing was sampled. Next: bayesplate fit, with the same card"
    return Shown(
        check_tables(report), (*report["identifiability"], report["invisible"]), tuple(report["notes"]), closing
    )


def show_fit(summary: Mapping[str, Any]) -> Shown:
    """The summary of `bayesplate.workflow.fit.fit` for a person."""
    unlabelled = unlabelled_table(summary)
    tables = (constants_table(summary), modes_table(summary), *([unlabelled] if unlabelled else []))
    error, model = summary["error"], summary["model"]
    left_out = error["leave_one_out_rms_cents"]
    noise = ", ".join(f"{100 * entry['q50']:.2f} %" for entry in summary["noise"].values())
    closing = (
        f"{model['theory']} plate, {model['law']} law. Error rms {error['in_sample_rms_cents']:.1f} cents in sample, "
        + (f"{left_out:.1f} left out" if left_out is not None else "too few modes to leave one out")
        + f"; noise {noise}; the linear law is off by {error['linearisation_rms_cents']:.1f} cents."
    )
    return Shown(tables, tuple(summary["identifiability"]), tuple(summary["warnings"]), closing)


def show_compare(comparison: Mapping[str, Any]) -> Shown:
    """The result of `bayesplate.workflow.compare.compare` for a person."""
    theories = comparison["theories"]
    tables = [table for one in theories for table in (methods_table(comparison["name"], one), forward_table(one))]
    told: dict[str, list[str]] = {}
    for one in theories:
        for origin in one["coefficients"]:
            setup = f", setup {origin['setup']}" if len(one["coefficients"]) > 1 else ""
            told.setdefault(origin["sentence"], []).append(one["theory"] + setup)
    remarks = [f"coefficients of paper and percentile ({', '.join(where)}): {text}" for text, where in told.items()]
    return Shown(tuple(tables), (*remarks, METHODS_REMARK), (), comparison["verdict"]["sentence"])


def show_diagnosis(diagnosis: Diagnosis) -> Shown:
    """The result of `bayesplate.workflow.diagnose.diagnose` for a person."""
    tables = (errors_table(diagnosis), shift_table(diagnosis), candidates_table(diagnosis, narrow=True))
    return Shown(
        tuple(table for table in tables if table is not None),
        (*diagnosis.sentences, diagnosis.recommendation),
        diagnosis.notes,
        verdict_sentence(diagnosis),
    )


def show_modes(report: Mapping[str, Any]) -> Shown:
    """The report of `bayesplate.workflow.modes.modes` for a person."""
    tables = tuple(sheet_table(report["name"], setup) for setup in report["setups"])
    files = f"; sheet to print: {', '.join(report['files'])}" if report["files"] else ""
    return Shown(tables, (), tuple(report["notes"]), f"Frequencies {report['basis']}{files}")


def progress_text(progress: Progress) -> str:
    """Where sampling stands, in one line."""
    text = f"sampling: step {progress.n_steps} of at most {progress.max_steps}"
    verdict = progress.convergence
    if verdict is None:
        return text
    n_taus = verdict.n_kept_steps / verdict.tau_max
    return f"{text}; {n_taus:.0f} of 50 autocorrelation times, R-hat {verdict.rhat_max:.4f}"
