"""`fit --repeat`: the fit that a summary is of, once more; refused where anything that it depends on differs."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from bayesplate.cards import NamedCards, PriorCard, card_names, load_board, load_named, load_prior, read_board_text
from bayesplate.cards.words import shown
from bayesplate.errors import Fault, InputError, plain
from bayesplate.posterior.sampling import Progress
from bayesplate.results.folder import SUMMARY, json_text
from bayesplate.results.summary import FORMAT
from bayesplate.results.versions import versions
from bayesplate.workflow.arguments import require_arguments
from bayesplate.workflow.fit import FitResult, fit
from bayesplate.workflow.one_thread import one_thread_each
from bayesplate.workflow.prepare import default_folder, prepared_card
from bayesplate.workflow.problem import Problem

if TYPE_CHECKING:
    from bayesplate.workflow.campaign_result import CampaignFitResult

_LARGEST_SUMMARY = 50_000_000
_NEEDED = {
    "format": int, "name": str, "seed": int, "versions": dict, "card_sha256": str, "model": dict, "request": dict,
}  # fmt: skip
_NEEDED_OF_REQUEST = {"card": str, "named": dict}


@dataclass(frozen=True, eq=False, repr=False)
class RepeatResult:
    """A fit that was repeated.

    Attributes
    ----------
    result : FitResult
    differs : tuple of str
        Entries of summary.json that are not what they were; empty if it is the same to the byte.
    """

    result: FitResult
    differs: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """What a person should know of it."""
        if not self.differs:
            return "repeated: summary.json is the same to the byte"
        return (
            f"repeated, and summary.json differs in {', '.join(self.differs)}: the versions agree, so that another "
            "processor or another library for matrices is left, or a diagnosis that chose the form of an effect"
        )

    def __repr__(self) -> str:
        return f"<RepeatResult of {self.result.summary.name}: {self.sentence}>"


@one_thread_each()
def repeat(
    summary: str | os.PathLike[str],
    card: str | os.PathLike[str] | None = None,
    *,
    out: str | os.PathLike[str] | None = None,
    report: bool = True,
    force: bool = False,
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> RepeatResult:
    """Fit again what a summary is of: its card, effects, law and seed.

    Parameters
    ----------
    summary : path
        The summary.json of a fit of one board.
    card : str or path, optional
        The card, where its prior or tables stand beside it; its text must be that of the summary.
    out : path, optional
        Output folder, as of `fit`; nothing is written without it.
    report, force, resume, progress
        As of `fit`.

    Returns
    -------
    RepeatResult

    Raises
    ------
    InputError
        If it is no summary of a fit, or anything that the fit depends on differs: versions, the card, its prior and
        tables. All of it is told at once, and nothing is written.
    NotIdentifiableError, NotConvergedError, CheckpointError
        As of `fit`.
    """
    require_arguments(
        source=summary, card_or_none=card, out=out, report=report, force=force, resume=resume, progress=progress
    )
    path = Path(summary)
    before = _read(path)
    problem = _problem(before, path, card)
    done = fit(problem, out=out, report=report, seed=before["seed"], force=force, resume=resume, progress=progress)
    after = json.loads(json_text(cast(FitResult, done).summary))
    differs = tuple(name for name in {**before, **after} if before.get(name) != after.get(name))
    return RepeatResult(cast(FitResult, done), differs)


def default_repeat_folder(summary: str | os.PathLike[str]) -> Path:
    """Where the command line writes it unless it is told: results/NAME-repeated."""
    return Path("results") / f"{_read(Path(summary))['name']}-repeated"


def fit_or_repeat(
    card: str | None,
    summary: str | None,
    *,
    out: str | None,
    report: bool,
    force: bool,
    resume: bool,
    progress: Callable[[Progress], None] | None,
    **asked: Any,
) -> tuple[FitResult | CampaignFitResult, str]:
    """What `bayesplate fit` does, with its default folder: the result, and what is said of a repetition."""
    options: dict[str, Any] = {"report": report, "force": force, "resume": resume, "progress": progress}
    if summary is None:
        assert card is not None  # the command line has seen to it
        return fit(card, out=default_folder(card) if out is None else out, **options, **asked), ""
    done = repeat(summary, card, out=default_repeat_folder(summary) if out is None else out, **options)
    return done.result, f"{done.sentence}; "


def _read(path: Path) -> dict[str, Any]:
    """A summary that can be repeated."""
    file = plain(str(path))
    try:
        if path.is_dir():
            path = path / SUMMARY
        if not path.is_file():
            raise InputError(Fault(file, f"the {SUMMARY} of a fit", "no such file"))
        if path.stat().st_size > _LARGEST_SUMMARY:
            raise InputError(Fault(file, f"the {SUMMARY} of a fit", "a file of more than 50 MB"))
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(Fault(file, "a readable file", error.strerror or str(error))) from None
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(Fault(file, f"the {SUMMARY} of a fit", "no JSON")) from None
    faults = list(_faults(found, file))
    if faults:
        raise InputError(faults)
    return cast(dict[str, Any], found)


def _faults(found: Any, file: str) -> Iterator[Fault]:
    """What a summary lacks."""
    if not isinstance(found, dict) or "card_sha256" not in found:
        yield Fault(file, f"the {SUMMARY} of a fit", "JSON of something else")
        return
    if "boards" in found:
        yield Fault(file, "a fit of one board", "one of a campaign", "fit its card again")
        return
    if found.get("format") != FORMAT:
        yield Fault(f"{file} format", str(FORMAT), shown(found.get("format")))
    if found.get("request") is None:
        told = "none: a board of a campaign, or made before summaries could be repeated"
        yield Fault(f"{file} request", "what the fit was asked for", told, "fit the card again")
        return
    of_request = found["request"] if isinstance(found["request"], dict) else {}
    for place, table, needed in (("", found, _NEEDED), ("request ", of_request, _NEEDED_OF_REQUEST)):
        for name, kind in needed.items():
            value = table.get(name)
            if not isinstance(value, kind) or isinstance(value, bool):
                yield Fault(f"{file} {place}{name}", f"a value of kind {kind.__name__}", shown(value))


def _problem(before: Mapping[str, Any], path: Path, card: str | os.PathLike[str] | None) -> Problem:
    """The problem that a summary is of; raises InputError with everything that differs."""
    file, request, model = plain(str(path)), before["request"], before["model"]
    read = read_board_text(request["card"], before["name"], beside=path.parent) if card is None else load_board(card)
    named = load_named(read, _prior_of(request["named"]))
    text = hashlib.sha256(request["card"].encode("utf-8", "surrogatepass")).hexdigest()
    faults = [
        *_different(f"{file} versions", before["versions"], versions(), "install these versions"),
        *_different(f"{file} card_sha256", {"card": before["card_sha256"]}, {"card": text}, "the file was edited"),
        *_different(f"{file} request named", request["named"], named.digests, "bring back the card that was used"),
        *named.faults,
    ]
    if card is not None:  # the text's own name was held to the summary's when it was read: folders are called after it
        faults += _different(f"{file} name", {"card": before["name"]}, {"card": read.name}, "")
        faults += _different(f"{file} card_sha256", {"card": before["card_sha256"]}, {"card": read.sha256}, "")
    if faults:
        raise InputError(faults)
    law, robust, effects = request.get("law"), model.get("robust", False), model.get("effects", [])
    require_arguments(law=law, robust=robust, effects=effects, seed=before["seed"])
    return Problem(prepared_card(read, named, effects), law, robust)


def _prior_of(named: Mapping[str, Any]) -> PriorCard | None:
    """The shipped prior that a fit used, which may be another one than its card names; None if it is none of them."""
    for name in card_names("priors"):
        digest = named.get(f"prior {name}")
        if digest is not None:
            card = load_prior(name)
            return card if NamedCards(card, {}, ()).digests[f"prior {name}"] == digest else None
    return None


def _different(place: str, wanted: Mapping[str, Any], got: Mapping[str, Any], remedy: str) -> Iterator[Fault]:
    """Every entry that is not what it was."""
    for name in {**wanted, **got}:
        if wanted.get(name) != got.get(name):
            then, now = (plain(str(one.get(name, "none"))) for one in (wanted, got))
            yield Fault(f"{place} {plain(str(name))}", then, now, remedy)
