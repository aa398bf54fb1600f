"""A diagnosis in sentences that people read."""

from __future__ import annotations

from bayesplate.diagnosis.wording.diagnosis import Diagnosis
from bayesplate.diagnosis.wording.words import claim_sentence, meaning
from bayesplate.effects.words import effect_names


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """The verdict, what it means, its reason, and whether a lower error may be claimed: the closing words of a run."""
    parts = (
        f"Verdict: {diagnosis.verdict}.",
        meaning(diagnosis),
        f"The reason: {diagnosis.reason}.",
        claim_sentence(diagnosis),
    )
    return " ".join(part for part in parts if part)


def verdict_sentences(diagnosis: Diagnosis) -> list[str]:
    """The verdict for a page: what it means, what each effect is, what the constants include, what may be claimed."""
    told = [meaning(diagnosis), *diagnosis.sentences, included_sentence(diagnosis), claim_sentence(diagnosis)]
    return [sentence for sentence in told if sentence]


def included_sentence(diagnosis: Diagnosis) -> str:
    """Which effects the constants of the diagnosis take into account; empty where there was nothing to add."""
    if diagnosis.is_refitted:
        return f"The constants take {effect_names(diagnosis.refitted)} into account."
    return "The constants are those of the ideal plate." if diagnosis.effects else ""


def remarks(diagnosis: Diagnosis) -> list[str]:
    """What else there is to know: how probable no effect is, the reason of the verdict, notes of the run."""
    likely = f"Probability that no effect of the library is at work: {100 * diagnosis.probability_of_none:.0f} %."
    return [likely, diagnosis.reason, *diagnosis.notes]
