"""From recordings to spectra: every hit of every file, and everything that stands in the way at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bayesplate.errors import Fault, InputError
from bayesplate.recordings.checks import force_fault, is_cut_to_silence, is_pulse, phase_fault
from bayesplate.recordings.hits import LEAST_DURATION, Hit, find_hits, rising_again, usable
from bayesplate.recordings.padding import common_padding
from bayesplate.recordings.signals import FrequencyResponse, Read, Recording
from bayesplate.recordings.spectra import Spectra, decay_spectra, response_spectra

_OVER_HIGHEST = 2.5
"""Samples a second over the highest frequency, at least."""
_SHORT = 0.5
"""Share of the usual length below which a decay is left out, so that it does not shorten all others."""
_RATE_OFF = 1e-6
_MOST_TIMES = 4
_APART = "pick them apart"
_Struck = list[tuple[Recording, list[Hit]]]


class Heard(NamedTuple):
    """What was taken from recordings, and what was left out and why."""

    spectra: Spectra
    remarks: tuple[str, ...]


def take(files: Sequence[Sequence[Read]], highest: float) -> Heard:
    """Spectra of everything that files hold, for modes up to some Hz.

    A file without a hit that can be used, or that does not go with the others, is refused.
    """
    every = [one for file in files for one in file]
    remarks = [told for one in every for told in one.remarks]
    responses = [one for one in every if isinstance(one, FrequencyResponse)]
    recordings = [one for one in every if isinstance(one, Recording)]
    if responses and recordings:
        raise InputError(Fault("FILES", "recordings or frequency responses", "both", _APART))
    if responses:
        if faults := _response_faults(responses):
            raise InputError(faults)
        padding = common_padding(responses)
        if padding > 1:
            told = f"of every {padding} lines one was measured and is used, the others are interpolated"
            remarks.append(f"{responses[0].name}: {told}")
        return Heard(response_spectra(responses, highest, padding), tuple(remarks))
    faults = _recording_faults(recordings, highest)
    pulses = [one for one in recordings if one.force is None and is_pulse(one.response, one.rate)]
    told = "it is silent after its pulse: is it the force?"
    if len(pulses) == len(recordings):
        remedy = "--channels, or the name of its column"
        raise InputError([*faults, *(Fault(one.name, "a response, which rings", told, remedy) for one in pulses)])
    remarks += [f"{one.name} left out: {told}" for one in pulses]
    heard: _Struck = []
    for file in files:
        own = [(one, find_hits(one)) for one in file if isinstance(one, Recording) and one not in pulses]
        for one, hits in own:
            if not hits and any(others for _, others in own):
                remarks.append(f"{one.name} left out: no hit stands out of its noise (is it connected?)")
            elif wrong := _hit_faults(one, hits):
                faults += wrong
            else:
                remarks += _told_of(one, hits)
                heard.append((one, usable(hits)))
    if faults:
        raise InputError(faults)
    kept, short = _without_short(heard)
    spectra = decay_spectra(kept, highest)
    return Heard(spectra, (*remarks, *short, *_risen(kept, spectra.duration)))


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
    spectra = decay_spectra([(one, (hit,)) for one, hit in impulses], highest)
    return Heard(spectra, tuple(told for one, _ in impulses for told in one.remarks))


def _hit_faults(one: Recording, hits: Sequence[Hit]) -> list[Fault]:
    if (no_force := force_fault(one)) is not None:
        return [no_force]
    if not hits:
        wanted = "a hit that stands out of the quiet"
        return [Fault(one.name, wanted, "none", "leave a moment of quiet before each hit")]
    if 2 * len(usable(hits)) >= len(hits):
        return []
    remedy = "hit again, and wait until it is silent"
    if is_cut_to_silence(one.response, one.rate):
        remedy = "digital silence between: switch off the noise gate, or noise suppression, and hit again"
    wanted = "one hit, and time to ring down"
    return [Fault(f"{one.name} {which}", wanted, fault, remedy) for which, fault in _unusable(one, hits)]


def _told_of(one: Recording, hits: Sequence[Hit]) -> list[str]:
    """What is told of the hits of a recording that is used."""
    told = [f"{one.name}: {which} left out, {fault}" for which, fault in _unusable(one, hits)]
    if after := [(hit.stop - hit.onset) / one.rate for hit in usable(hits) if hit.is_gated]:
        what = "a noise gate, or noise suppression? (switch it off)"
        told.append(f"{one.name}: the sound breaks off {min(after):.2g} s after a hit: {what}")
    return told


def _unusable(one: Recording, hits: Sequence[Hit]) -> list[tuple[str, str]]:
    numbered = enumerate(hits, start=1)
    return [(f"hit {number} at {hit.onset / one.rate:.2f} s", hit.fault) for number, hit in numbered if hit.fault]


def _response_faults(responses: Sequence[FrequencyResponse]) -> list[Fault]:
    first = responses[0]
    faults = [fault for one in responses if (fault := phase_fault(one)) is not None]
    for one in responses[1:]:
        if one.frequency.shape != first.frequency.shape or not np.allclose(one.frequency, first.frequency, rtol=1e-6):
            faults.append(Fault(f"{one.name} frequencies", f"those of {first.name}", "others", _APART))
        if one.motion != first.motion:
            faults.append(Fault(one.name, f"{first.motion}, as {first.name}", one.motion, _APART))
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
            faults.append(Fault(one.name, f"the channels of {first.name}", got, _APART))
        if one.motion != first.motion:
            faults.append(Fault(one.name, f"{first.motion}, as {first.name}", one.motion, _APART))
    return faults


def _risen(heard: _Struck, duration: float) -> list[str]:
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


def _without_short(heard: _Struck) -> tuple[_Struck, list[str]]:
    """All decays but those far shorter than usual, and what is told of these."""
    least = _SHORT * float(np.median([hit.stop - hit.start for _, hits in heard for hit in hits]))
    kept = [(one, [hit for hit in hits if hit.stop - hit.start >= least]) for one, hits in heard]
    told = [
        f"{one.name}: the hit at {hit.onset / one.rate:.2f} s left out, it rings for "
        f"{(hit.stop - hit.start) / one.rate:.2g} s only"
        for one, hits in heard
        for hit in hits
        if hit.stop - hit.start < least
    ]
    return [(one, hits) for one, hits in kept if hits], told
