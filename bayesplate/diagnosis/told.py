"""A diagnosis in sentences that people read."""

from __future__ import annotations

from collections.abc import Sequence

from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.candidates import EffectEntry
from bayesplate.diagnosis.known_words import known_sentence
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.diagnosis.signatures import LOOK_ALIKE
from bayesplate.diagnosis.stated import LEAST_FALL, StatedClaim
from bayesplate.diagnosis.words import claim_sentence, meaning
from bayesplate.effects.words import effect_names, joined
from bayesplate.estimates.leave_one_out import carrying_sentence
from bayesplate.labels import Label


def carrying_words(diagnosis: Diagnosis) -> str:
    """Which modes alone carry a constant or a size, and so count in no left-out error; empty where none does."""
    told = carrying_sentence(diagnosis.carrying_modes)
    if not told:
        return ""
    before, after = (one.leave_one_out_rms_cents for one in (diagnosis.before, diagnosis.after))
    no_more = "" if None not in (before, after) else "; no mode is left to judge by, and nothing can be claimed"
    return f"{told[0].upper()}{told[1:]}, before and after alike{no_more}."


def in_part_sentence(diagnosis: Diagnosis) -> str:
    """What explains the readings in part, and that something else remains; empty where nothing does."""
    if not diagnosis.named_in_part:
        return ""
    return f"Named in part: {diagnosis.in_part_words}; something else remains. The constants are not to be trusted."


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """The verdict, what it means, its reason, and whether a lower error may be claimed: the closing words of a run."""
    parts = (
        f"Verdict: {diagnosis.verdict}.",
        in_part_sentence(diagnosis),
        meaning(diagnosis),
        f"The reason: {diagnosis.reason}.",
        claim_sentence(diagnosis),
    )
    return " ".join(part for part in parts if part)


def verdict_sentences(diagnosis: Diagnosis) -> list[str]:
    """The verdict for a page: what it means, what each effect is, what else looks like it, and what may be claimed."""
    told = [
        in_part_sentence(diagnosis),
        meaning(diagnosis),
        *diagnosis.sentences,
        alike_sentence(diagnosis),
        claim_sentence(diagnosis),
        carrying_words(diagnosis),
    ]
    return [sentence for sentence in told if sentence]


def known_sentences(diagnosis: Diagnosis) -> list[str]:
    """What known effects do to the error, and what may be claimed of those that the card states."""
    told = (known_sentence(diagnosis.known), *stated_sentences(diagnosis.stated_claims))
    return [sentence for sentence in told if sentence]


def alike_sentence(diagnosis: Diagnosis) -> str:
    """Effects outside the verdict that look like the one that is named; empty if there are none."""
    if diagnosis.verdict != "named":
        return ""
    inside = [one for one in diagnosis.candidates if isinstance(one, EffectEntry) and one.name in diagnosis.effects]
    alike = dict.fromkeys(name for one in inside for name in one.look_alikes if name not in diagnosis.effects)
    if not alike:
        return ""
    return (
        f"{effect_names(list(alike)).capitalize()} would look much the same (likeness above {LOOK_ALIKE}): less than a "
        "third of the trace tells them apart."
    )


def shown_model(diagnosis: Diagnosis) -> str:
    """Which model the figures and tables below a verdict belong to; empty where it is the only one."""
    if not diagnosis.is_refitted:
        return ""
    model = f"the model with {diagnosis.refitted_words}"
    if diagnosis.named_in_part:
        return f"The constants and all else below are of {model}, which does not explain the readings either."
    told = f"The table of the constants is of the averaged ones; all else below is of {model}"
    if diagnosis.verdict == "named":
        return f"{told}."
    return f"{told}, which is only one of the explanations. Quote the averaged constants."


def headline_sentence(diagnosis: Diagnosis) -> str:
    """What the constants that are shown first are."""
    if diagnosis.verdict == "unexplained":
        return ""
    return "These constants are averaged over everything that may be the case, each by its probability."


def warnings(diagnosis: Diagnosis) -> list[str]:
    """What a reader must know before using the constants."""
    if diagnosis.verdict != "unexplained":
        return list(diagnosis.notes)
    doubt = "The model does not explain the readings: the intervals of the constants are too narrow."
    return [doubt, *diagnosis.notes]


def remarks(diagnosis: Diagnosis) -> list[str]:
    """What else there is to know: the reason of the verdict, notes of the run."""
    return [f"The reason: {diagnosis.reason}.", *diagnosis.notes]


def stated_sentences(claims: Sequence[StatedClaim]) -> list[str]:
    """A sentence on each: what is predicted, the error without and with the effects, and whether it is reduced."""
    return [_stated_sentence(one) for one in claims]


def _stated_sentence(one: StatedClaim) -> str:
    who = f"{effect_names(one.effects)}, as stated and not chosen by the readings,"
    verb = "takes" if len(one.effects) == 1 else "take"
    if one.predicts:
        what = f"the error of setup '{one.predicts}', predicted by the constants of the first setup alone,"
    else:
        what = "the left-out error"
    told = (
        f"{who[0].upper()}{who[1:]} {verb} {what} from {one.before_rms_cents:.1f} to {one.after_rms_cents:.1f} cents; "
        f"the log score changes by {one.log_score_gain:+.1f} ± {one.standard_error:.1f} over {one.n_modes} modes"
    )
    if one.holds:
        return f"{told}: error reduced."
    needs = f"that asks for a fall by {LEAST_FALL:.0%} and a score that rises by more than two standard errors"
    return f"{told}. That an error is reduced is not claimed: {needs}."


def relabelled_sentence(before: Board, after: Board, words: str) -> str:
    """Which peaks have another label in the model after than in the one before; empty where none has."""
    first, second = _labels(before), _labels(after)
    changed = []
    for key in sorted(first.keys() | second.keys(), key=lambda each: (each[0], each[1].mean)):
        one, other = first.get(key), second.get(key)
        if one != other:
            where = f" in setup {key[0]}" if len(before.setups) > 1 else ""
            instead = "no likely mode" if other is None else str(other)
            was = "had no likely mode" if one is None else f"was {one}"
            changed.append(f"{key[1].mean:.5g} Hz{where} is {instead} (it {was})")
    return f"With {words} some peaks are other modes: {joined(changed)}." if changed else ""


def _labels(board: Board) -> dict[tuple[str, Quantity], Label]:
    """Labels by setup and frequency of the peak."""
    return {(setup.name, reading.frequency): reading.label for setup in board.setups for reading in setup.readings}
