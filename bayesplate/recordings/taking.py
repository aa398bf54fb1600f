"""From recordings to spectra: every hit of every file, and everything that stands in the way at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.errors import Fault, InputError
from bayesplate.recordings.channels import force_fault, is_cut_to_silence, is_pulse
from bayesplate.recordings.checks import phase_fault
from bayesplate.recordings.hits import LEAST_DURATION, Hit, find_hits, rising_again, usable
from bayesplate.recordings.padding import common_padding
from bayesplate.recordings.reading import Read
from bayesplate.recordings.signals import FrequencyResponse, Recording
from bayesplate.recordings.spectra import Spectra, decay_spectra, response_spectra

_OVER_HIGHEST = 2.5
"""Samples a second over the highest frequency, at least."""
_SHORT = 0.5
"""Share of the usual length below which a decay is left out, so that it does not shorten all others."""
_RATE_OFF = 1e-6
_MOST_TIMES = 4


@dataclass(frozen=True, eq=False)
class Heard:
    """What was taken from recordings.

    Attributes
    ----------
    spectra : Spectra
    hits : tuple of (Recording, tuple of Hit)
        Those that were used; empty for frequency responses.
    remarks : tuple of str
        What was left out, and why.
    """

    spectra: Spectra
    hits: tuple[tuple[Recording, tuple[Hit, ...]], ...]
    remarks: tuple[str, ...]


def take(files: Sequence[Sequence[Read]], highest: float) -> Heard:
    """Spectra of everything that files hold.

    Parameters
    ----------
    files : sequence of sequence of Recording or FrequencyResponse
    highest : float, Hz
        Up to which modes are looked for.

    Returns
    -------
    Heard

    Raises
    ------
    InputError
        With every file that has no hit that can be used, or that does not go with the others.
    """
    every = [one for file in files for one in file]
    remarks = [told for one in every for told in one.remarks]
    responses = [one for one in every if isinstance(one, FrequencyResponse)]
    if responses:
        faults = _response_faults(every, responses)
        if faults:
            raise InputError(faults)
        padding = common_padding(responses)
        if padding > 1:
            told = f"of every {padding} lines one was measured and is used, the others are interpolated"
            remarks.append(f"{responses[0].name}: {told}")
        return Heard(response_spectra(responses, highest, padding), (), tuple(remarks))
    recordings = [one for one in every if isinstance(one, Recording)]
    faults = _recording_faults(recordings, highest)
    heard: list[tuple[Recording, list[Hit]]] = []
    silent = [one for one in recordings if one.force is None and is_pulse(one.response, one.rate)]
    are_all = len(silent) == len(recordings)
    wanted, got = "a response, which rings", "it is silent after its pulse: is it the force?"
    faults += [Fault(one.name, wanted, got, "--channels, or the name of its column") for one in silent if are_all]
    remarks += [f"{one.name} left out: {got}" for one in silent if not are_all]
    for one in (one for one in recordings if one not in silent):
        if (no_force := force_fault(one)) is not None:
            faults.append(no_force)
            continue
        hits = find_hits(one)
        good = usable(hits)
        bad = [(number, hit) for number, hit in enumerate(hits, start=1) if hit.fault]
        if not hits:
            wanted = "a hit that stands out of the quiet"
            faults.append(Fault(one.name, wanted, "none", "leave a moment of quiet before each hit"))
        elif 2 * len(good) < len(hits) or not good:
            faults += [_hit_fault(one, number, hit) for number, hit in bad]
        else:
            remarks += [
                f"{one.name}: hit {number} at {hit.onset / one.rate:.2f} s left out, {hit.fault}" for number, hit in bad
            ]
            gated = [hit for hit in good if hit.is_gated]
            if gated:
                after = min(hit.stop - hit.onset for hit in gated) / one.rate
                remarks.append(
                    f"{one.name}: the sound breaks off {after:.2g} s after a hit: a noise gate, or noise suppression? "
                    "(switch it off)"
                )
            heard.append((one, good))
    if faults:
        raise InputError(faults)
    kept, short = _without_short(heard)
    spectra = decay_spectra(kept, highest)
    remarks += [*short, *_risen(kept, spectra.duration)]
    return Heard(spectra, tuple((one, tuple(hits)) for one, hits in kept), tuple(remarks))


def take_impulses(impulses: Sequence[tuple[Recording, Hit]], highest: float) -> Heard:
    """Spectra of impulse responses that were made from sweeps; parameters and faults as of `take`."""
    faults = _recording_faults([one for one, _ in impulses], highest)
    faults += [
        Fault(one.name, f"{LEAST_DURATION:g} s after the end of the sweep", "less", "record on until it is silent")
        for one, hit in impulses
        if hit.stop - hit.start < LEAST_DURATION * one.rate
    ]
    if faults:
        raise InputError(faults)
    hits = tuple((one, (hit,)) for one, hit in impulses)
    return Heard(decay_spectra(hits, highest), hits, tuple(told for one, _ in impulses for told in one.remarks))


def _hit_fault(one: Recording, number: int, hit: Hit) -> Fault:
    place = f"{one.name} hit {number} at {hit.onset / one.rate:.2f} s"
    remedy = "hit again, and wait until it is silent"
    if is_cut_to_silence(one.response, one.rate):
        remedy = "digital silence between: switch off the noise gate, or noise suppression, and hit again"
    return Fault(place, "one hit, and time to ring down", hit.fault, remedy)


def _response_faults(every: Sequence[Read], responses: Sequence[FrequencyResponse]) -> list[Fault]:
    if len(responses) < len(every):
        return [Fault("FILES", "recordings or frequency responses", "both", "pick them apart")]
    first = responses[0]
    faults = [fault for one in responses if (fault := phase_fault(one)) is not None]
    for one in responses[1:]:
        if one.frequency.shape != first.frequency.shape or not np.allclose(one.frequency, first.frequency, rtol=1e-6):
            faults.append(Fault(f"{one.name} frequencies", f"those of {first.name}", "others", "pick them apart"))
        if one.motion != first.motion:
            faults.append(Fault(one.name, f"{first.motion}, as {first.name}", one.motion, "pick them apart"))
    return faults


def _recording_faults(recordings: Sequence[Recording], highest: float) -> list[Fault]:
    first = recordings[0]
    faults = []
    for one in recordings:
        if one.rate < _OVER_HIGHEST * highest:
            wanted = f"{_OVER_HIGHEST * highest:g} samples a second or more for modes up to {highest:g} Hz"
            faults.append(Fault(f"{one.name} rate", wanted, f"{one.rate:g}", "is it right? --highest lowers the limit"))
        if abs(one.rate / first.rate - 1.0) > _RATE_OFF:
            faults.append(Fault(f"{one.name} rate", f"{first.rate:g} Hz, as {first.name}", f"{one.rate:g} Hz"))
        if (one.force is None) != (first.force is None):
            got = "without a force" if one.force is None else "with a force"
            faults.append(Fault(one.name, f"the channels of {first.name}", got, "pick them apart"))
        if one.motion != first.motion:
            faults.append(Fault(one.name, f"{first.motion}, as {first.name}", one.motion, "pick them apart"))
    return faults


def _risen(heard: Sequence[tuple[Recording, Sequence[Hit]]], duration: float) -> list[str]:
    """Recordings in which something else is heard while the board rings down."""
    told = []
    for one, hits in heard:
        if times := rising_again(one, hits, duration):
            at = ", ".join(f"{time:.2f}" for time in times[:_MOST_TIMES]) + (" and more" * (len(times) > _MOST_TIMES))
            told.append(
                f"{one.name}: the sound rises again within a ring-down, at {at} s: a soft tap or a noise, which makes "
                "lines that are no modes (record it again, or cut that hit out)"
            )
    return told


def _without_short(heard: Sequence[tuple[Recording, list[Hit]]]) -> tuple[list[tuple[Recording, list[Hit]]], list[str]]:
    """All decays but those far shorter than usual."""
    lengths = [hit.stop - hit.start for _, hits in heard for hit in hits]
    least = _SHORT * float(np.median(lengths))
    kept, told = [], []
    for one, hits in heard:
        long_enough = [hit for hit in hits if hit.stop - hit.start >= least]
        told += [
            f"{one.name}: the hit at {hit.onset / one.rate:.2f} s left out, it rings for "
            f"{(hit.stop - hit.start) / one.rate:.2g} s only"
            for hit in hits
            if hit not in long_enough
        ]
        if long_enough:
            kept.append((one, long_enough))
    return kept, told
