"""From recordings to spectra: the decays of all hits of all files, or every fault that stands in the way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bayesplate.errors import Fault, InputError
from bayesplate.recordings.checks import force_fault, is_cut_to_silence, is_pulse, phase_fault
from bayesplate.recordings.hits import LEAST_DURATION, Hit, find_hits, renewed_onsets, usable_hits
from bayesplate.recordings.padding import common_padding
from bayesplate.recordings.signals import FrequencyResponse, Recording, Signal
from bayesplate.recordings.spectra import Spectra, decay_spectra, response_spectra

_LEAST_OVERSAMPLING = 2.5
"""Least sampling rate over the highest frequency."""
_SHORT_SHARE = 0.5
"""Share of the median length below which a decay is left out, so that it does not shorten all others."""
_RATE_OFF = 1e-6
_MOST_TIMES = 4
_APART_REMEDY = "pick them apart"
_HitRecordings = list[tuple[Recording, list[Hit]]]


class TakenSpectra(NamedTuple):
    """Spectra of recordings or frequency responses, and remarks on what was left out and why."""

    spectra: Spectra
    remarks: tuple[str, ...]


def take_spectra(files: Sequence[Sequence[Signal]], highest: float) -> TakenSpectra:
    """Spectra of all hits or frequency responses in files, for modes up to `highest` Hz.

    A file without a usable hit, or of another kind, rate or motion than the others, is refused.
    """
    signals = [signal for file in files for signal in file]
    remarks = [remark for signal in signals for remark in signal.remarks]
    responses = [signal for signal in signals if isinstance(signal, FrequencyResponse)]
    recordings = [signal for signal in signals if isinstance(signal, Recording)]
    if responses and recordings:
        raise InputError(Fault("FILES", "recordings or frequency responses", "both", _APART_REMEDY))
    if responses:
        if faults := _response_faults(responses):
            raise InputError(faults)
        padding = common_padding(responses)
        if padding > 1:
            remark = f"of every {padding} lines one was measured and is used, the others are interpolated"
            remarks.append(f"{responses[0].name}: {remark}")
        return TakenSpectra(response_spectra(responses, highest, padding), tuple(remarks))
    faults = _recording_faults(recordings, highest)
    pulses = [
        recording
        for recording in recordings
        if recording.force is None and is_pulse(recording.response, recording.rate)
    ]
    remark = "it is silent after its pulse: is it the force?"
    if len(pulses) == len(recordings):
        remedy = "--channels, or the name of its column"
        raise InputError(
            [*faults, *(Fault(recording.name, "a response, which rings", remark, remedy) for recording in pulses)]
        )
    remarks += [f"{recording.name} left out: {remark}" for recording in pulses]
    recorded_hits: _HitRecordings = []
    for file in files:
        file_hits = [
            (signal, find_hits(signal)) for signal in file if isinstance(signal, Recording) and signal not in pulses
        ]
        for recording, hits in file_hits:
            if not hits and any(other_hits for _, other_hits in file_hits):
                remarks.append(f"{recording.name} left out: no hit stands out of its noise (is it connected?)")
            elif hit_faults := _hit_faults(recording, hits):
                faults += hit_faults
            else:
                remarks += _hit_remarks(recording, hits)
                recorded_hits.append((recording, usable_hits(hits)))
    if faults:
        raise InputError(faults)
    kept_hits, short_remarks = _drop_short_decays(recorded_hits)
    spectra = decay_spectra(kept_hits, highest)
    return TakenSpectra(spectra, (*remarks, *short_remarks, *_onset_remarks(kept_hits, spectra.duration)))


def take_impulses(impulses: Sequence[tuple[Recording, Hit]], highest: float) -> TakenSpectra:
    """Spectra of impulse responses that were made from sweeps; parameters and faults as of `take_spectra`."""
    faults = _recording_faults([recording for recording, _ in impulses], highest)
    faults += [
        Fault(
            recording.name, f"{LEAST_DURATION:g} s after the end of the sweep", "less", "record on until it is silent"
        )
        for recording, hit in impulses
        if hit.stop - hit.start < LEAST_DURATION * recording.rate
    ]
    if faults:
        raise InputError(faults)
    spectra = decay_spectra([(recording, (hit,)) for recording, hit in impulses], highest)
    return TakenSpectra(spectra, tuple(remark for recording, _ in impulses for remark in recording.remarks))


def _hit_faults(recording: Recording, hits: Sequence[Hit]) -> list[Fault]:
    if (no_force := force_fault(recording)) is not None:
        return [no_force]
    if not hits:
        wanted = "a hit that stands out of the quiet"
        return [Fault(recording.name, wanted, "none", "leave a moment of quiet before each hit")]
    if 2 * len(usable_hits(hits)) >= len(hits):
        return []
    remedy = "hit again, and wait until it is silent"
    if is_cut_to_silence(recording.response, recording.rate):
        remedy = "digital silence between: switch off the noise gate, or noise suppression, and hit again"
    wanted = "one hit, and time to ring down"
    return [
        Fault(f"{recording.name} {which}", wanted, fault, remedy) for which, fault in _unusable_hits(recording, hits)
    ]


def _hit_remarks(recording: Recording, hits: Sequence[Hit]) -> list[str]:
    """Remarks on the hits of a recording: those left out, and sounds that a noise gate cuts off."""
    remarks = [f"{recording.name}: {which} left out, {fault}" for which, fault in _unusable_hits(recording, hits)]
    if gate_times := [(hit.stop - hit.onset) / recording.rate for hit in usable_hits(hits) if hit.is_gated]:
        cause = "a noise gate, or noise suppression? (switch it off)"
        remarks.append(f"{recording.name}: the sound breaks off {min(gate_times):.2g} s after a hit: {cause}")
    return remarks


def _unusable_hits(recording: Recording, hits: Sequence[Hit]) -> list[tuple[str, str]]:
    return [(f"hit {hit.number} at {hit.onset / recording.rate:.2f} s", hit.fault) for hit in hits if hit.fault]


def _response_faults(responses: Sequence[FrequencyResponse]) -> list[Fault]:
    first = responses[0]
    faults = [fault for response in responses if (fault := phase_fault(response)) is not None]
    for response in responses[1:]:
        if response.frequency.shape != first.frequency.shape or not np.allclose(
            response.frequency, first.frequency, rtol=1e-6
        ):
            faults.append(Fault(f"{response.name} frequencies", f"those of {first.name}", "others", _APART_REMEDY))
        if response.motion != first.motion:
            faults.append(Fault(response.name, f"{first.motion}, as {first.name}", response.motion, _APART_REMEDY))
    return faults


def _recording_faults(recordings: Sequence[Recording], highest: float) -> list[Fault]:
    first = recordings[0]
    faults = []
    for recording in recordings:
        if recording.rate < _LEAST_OVERSAMPLING * highest:
            wanted = f"{_LEAST_OVERSAMPLING * highest:g} samples a second or more for modes up to {highest:g} Hz"
            faults.append(
                Fault(
                    f"{recording.name} rate", wanted, f"{recording.rate:g}", "is it right? --highest lowers the limit"
                )
            )
        if abs(recording.rate / first.rate - 1.0) > _RATE_OFF:
            faults.append(
                Fault(f"{recording.name} rate", f"{first.rate:g} Hz, as {first.name}", f"{recording.rate:g} Hz")
            )
        if (recording.force is None) != (first.force is None):
            got = "without a force" if recording.force is None else "with a force"
            faults.append(Fault(recording.name, f"the channels of {first.name}", got, _APART_REMEDY))
        if recording.motion != first.motion:
            faults.append(Fault(recording.name, f"{first.motion}, as {first.name}", recording.motion, _APART_REMEDY))
    return faults


def _onset_remarks(recorded_hits: _HitRecordings, duration: float) -> list[str]:
    """Remarks on recordings in which the sound rises again while the board rings down."""
    remarks = []
    for recording, hits in recorded_hits:
        if times := renewed_onsets(recording, hits, duration):
            moments = ", ".join(f"{time:.2f}" for time in times[:_MOST_TIMES]) + (
                " and more" * (len(times) > _MOST_TIMES)
            )
            remarks.append(
                f"{recording.name}: the sound rises again within a ring-down, at {moments} s: a soft tap or a noise, "
                "which makes lines that are no modes (record it again, or cut that hit out)"
            )
    return remarks


def _drop_short_decays(recorded_hits: _HitRecordings) -> tuple[_HitRecordings, list[str]]:
    """All decays but those far shorter than the median, and remarks on these."""
    least_samples = _SHORT_SHARE * float(np.median([hit.stop - hit.start for _, hits in recorded_hits for hit in hits]))
    kept_hits = [
        (recording, [hit for hit in hits if hit.stop - hit.start >= least_samples]) for recording, hits in recorded_hits
    ]
    remarks = [
        f"{recording.name}: the hit at {hit.onset / recording.rate:.2f} s left out, it rings for "
        f"{(hit.stop - hit.start) / recording.rate:.2g} s only"
        for recording, hits in recorded_hits
        for hit in hits
        if hit.stop - hit.start < least_samples
    ]
    return [(recording, hits) for recording, hits in kept_hits if hits], remarks
