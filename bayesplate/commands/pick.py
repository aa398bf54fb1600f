"""`pick`: recordings to frequencies with their uncertainty, labels, and the [setup] that a card takes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from bayesplate.commands.arguments import check_arguments
from bayesplate.commands.fragment import fragment_text
from bayesplate.commands.options import FilePath, Force
from bayesplate.commands.pick_labels import assign_pictures, label_peaks
from bayesplate.commands.pick_options import (
    Channels,
    Files,
    Hammer,
    Highest,
    Lowest,
    MotionWord,
    OptionalCard,
    PickOut,
    Polarity,
    Rate,
    Sand,
    Sensor,
    SensorMass,
    SweepOption,
    band_faults,
    place_faults,
    places_by_file,
    require_on_board,
)
from bayesplate.commands.pick_words import moved_hit_remarks, show_pick
from bayesplate.commands.prepare import PreparedBoard, prepare
from bayesplate.commands.printout import Printout
from bayesplate.errors import Fault, InputError, NotIdentifiableError, printable
from bayesplate.files import make_folder, require_new_files, write_text
from bayesplate.recordings.contract import LabelChance, PickedRow, PickReport
from bayesplate.recordings.picking import HIGHEST, LOWEST, PickedModes, pick_modes
from bayesplate.recordings.reading import READERS, read_recordings
from bayesplate.recordings.sand import read_picture
from bayesplate.recordings.signals import Recording
from bayesplate.recordings.sweeps import impulse_response, read_sweep, require_sweep, sweep_band
from bayesplate.recordings.taking import TakenSpectra, take_impulses, take_spectra
from bayesplate.results.contract import json_text
from bayesplate.results.folder import FIGURES_FOLDER

if TYPE_CHECKING:
    from bayesplate.arrays import Floats
    from bayesplate.recordings.hits import Hit
    from bayesplate.recordings.signals import Signal

FRAGMENT_FILE, PICK_PAGE_FILE, PICK_SUMMARY_FILE = "setup.toml", "recordings.html", "pick.json"
_RATE_TOLERANCE = 1e-6
_LEAST_LABEL, _MOST_LABELS = 0.005, 4
"""Least probability of a label that is listed, and the most labels of a peak."""


@dataclass(frozen=True, eq=False, repr=False)
class PickResult:
    """Result of `pick`.

    Attributes
    ----------
    summary : PickReport
    picked : PickedModes
        With the spectra.
    folder : Path or None
        Where its files are; None if none were asked for.
    """

    summary: PickReport
    picked: PickedModes
    folder: Path | None

    def __repr__(self) -> str:
        hertz = ", ".join(f"{peak.hz:.1f}" for peak in self.summary.likely[:8])
        return f"<PickResult of {', '.join(self.summary.files[:3])}: {len(self.summary.likely)} modes, Hz: {hertz}>"

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_pick(self.summary)

    def _repr_html_(self) -> str:
        return self.printout().html("Picked modes")


@check_arguments(place_faults, lambda arguments: band_faults(arguments, LOWEST, HIGHEST))
def pick(
    files: Files,
    *,
    card: OptionalCard = None,
    rate: Rate = None,
    hammer: Hammer = (),
    sensor: Sensor = (),
    sensor_mass: SensorMass = None,
    channels: Channels = "force,response",
    motion: MotionWord = "acceleration",
    polarity: Polarity = None,
    sweep: SweepOption = None,
    sand: Sand = None,
    lowest: Lowest = LOWEST,
    highest: Highest = HIGHEST,
    out: PickOut = None,
    force: Force = False,
) -> PickResult:
    """Pick the modes of a board from recordings of hits, taps or sweeps.

    Parameters
    ----------
    files : sequence of path
        WAV, FLAC or CSV; UFF with the extra `bayesplate[recordings]`. Files of which both places are given
        and the same are repeats.
    card : str or path, optional
        A board card with sizes and edges, which may be without frequencies: labels are computed for it.
    rate : float, optional, Hz
        For files that do not say it.
    hammer, sensor : sequence of (float, float), m
        Where the board was hit and listened to, from the corner x = y = 0: none, one for all files, or one for each.
    sensor_mass : (float, float), optional, kg
        Of the accelerometer, and its standard deviation; it is passed on to the card.
    channels : str
        What two channels of a sound file are, "force,response", "response,force" or "response,response", or the number
        of the only one that is used.
    motion : str
        What a response is whose file does not say it: "acceleration", "velocity", "displacement" or "pressure".
    polarity : str, optional
        "same" if a force towards the board and the response it causes have one sign, "opposite" if not. By default it
        is found by the labels, if there is a card.
    sweep : str, optional
        For recordings of an exponential sweep: "F1,F2,SECONDS", or the path of the sweep itself.
    sand : mapping, optional
        Frequency in Hz to a picture of sand, cropped to the part of the board that vibrates.
    lowest, highest : float, Hz
        Between which modes are looked for.
    out : path, optional
        Folder of setup.toml, recordings.html, pick.json and figures; nothing is written without it.
    force : bool
        Replace what is there.

    Returns
    -------
    PickResult

    Raises
    ------
    InputError
        With every fault of the arguments, then of all files, then of all hits; nothing is written then.
    """
    targets = (
        ()
        if out is None
        else require_new_files(Path(out), (FRAGMENT_FILE, PICK_PAGE_FILE, PICK_SUMMARY_FILE), force=force)
    )
    prepared = None if card is None else _require_one_setup(prepare(card, may_lack_frequencies=True))
    if prepared is not None:
        # a microphone may be beside the board, and is nowhere on a card
        require_on_board(prepared.card, hammer, () if motion == "pressure" else sensor, sensor_mass)
    pictures = {hertz: read_picture(path) for hertz, path in (sand or {}).items()}
    signals_by_file = read_recordings(files, rate, channels, motion)
    signals_by_file = [
        [replace(signal, hammer=hammer_place, sensor=sensor_place) for signal in file_signals]
        for file_signals, (hammer_place, sensor_place) in zip(
            signals_by_file, places_by_file(hammer, sensor, signals_by_file), strict=True
        )
    ]
    if sweep is None:
        measured = take_spectra(signals_by_file, highest)
    else:
        impulses, (sweep_lowest, sweep_highest) = _impulse_responses(signals_by_file, os.fspath(sweep), rate, highest)
        lowest, highest = max(lowest, sweep_lowest), min(highest, sweep_highest)
        measured = take_impulses(impulses, highest)
    picked = pick_modes(measured.spectra, lowest, highest)
    summary = _summary(files, measured, picked, prepared, polarity, pictures, sensor_mass)
    if out is not None:
        _write(Path(out), targets, summary, picked)
    return PickResult(summary, picked, None if out is None else Path(out))


def _require_one_setup(prepared: PreparedBoard) -> PreparedBoard:
    """Refuse a card with several setups, of which the labels could be of any."""
    if len(prepared.board.setups) > 1:
        names = ", ".join(setup.name for setup in prepared.board.setups)
        raise InputError(Fault(prepared.board.name, "a card with one setup", names, "one card for the edges at hand"))
    return prepared


def _impulse_responses(
    signals_by_file: Sequence[Sequence[Signal]], sweep: str, rate: float | None, highest: float
) -> tuple[list[tuple[Recording, Hit]], tuple[float, float]]:
    """Impulse responses in place of recordings of a sweep, each as if the board had been hit once; and its band, Hz."""
    recordings = [
        signal
        for file_signals in signals_by_file
        for signal in file_signals
        if isinstance(signal, Recording) and signal.force is None
    ]
    wrong_files = [
        signal.name for file_signals in signals_by_file for signal in file_signals if signal not in recordings
    ]
    if wrong_files:
        wanted = "one channel with the response to the sweep"
        raise InputError(
            [Fault(name, wanted, "another kind of file", "leave --sweep out for hits") for name in wrong_files]
        )
    sweep_signals: list[Floats]
    if not os.path.exists(sweep) and Path(sweep).suffix.lower() not in READERS:
        exponential_sweep = read_sweep(sweep)
        sweep_signals = [exponential_sweep.signal(recording.rate) for recording in recordings]
    else:
        ((sweep_recording, *_),) = read_recordings([sweep], rate, was_played=True)
        if not isinstance(sweep_recording, Recording):
            raise InputError(Fault(printable(sweep), "a recording of the sweep", "a frequency response"))
        require_sweep(sweep_recording)
        mismatched = [
            recording for recording in recordings if abs(recording.rate / sweep_recording.rate - 1.0) > _RATE_TOLERANCE
        ]
        if mismatched:
            wanted = f"{sweep_recording.rate:g} Hz, as the sweep"
            raise InputError(
                [Fault(f"{recording.name} rate", wanted, f"{recording.rate:g} Hz") for recording in mismatched]
            )
        sweep_signals = [sweep_recording.response] * len(recordings)
    impulses, faults = [], list[Fault]()
    for recording, sweep_signal in zip(recordings, sweep_signals, strict=True):
        try:
            impulses.append(impulse_response(recording, sweep_signal, highest))
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    bands = [
        sweep_band(sweep_signal, recording.rate)
        for recording, sweep_signal in zip(recordings, sweep_signals, strict=True)
    ]
    return impulses, (max(low for low, _ in bands), min(high for _, high in bands))


def _summary(
    files: Sequence[FilePath],
    measured: TakenSpectra,
    picked: PickedModes,
    prepared: PreparedBoard | None,
    polarity: str | None,
    pictures: Mapping[float, Floats],
    sensor_mass: tuple[float, float] | None,
) -> PickReport:
    names = tuple(printable(Path(path).name) for path in files)
    flips = None if polarity is None else polarity == "opposite"
    remarks = [*measured.remarks, *picked.remarks]
    labels = None
    if prepared is not None:
        straightened_pictures, picture_remarks = assign_pictures(prepared.board, picked.likely, pictures)
        remarks += picture_remarks
        try:
            labels = label_peaks(prepared.board, prepared.prior, picked, flips, straightened_pictures)
            flips, remarks = labels.flips, [*remarks, *labels.doubts]
        except NotIdentifiableError as error:
            remarks.append(f"no labels: {error}")
    elif pictures:
        remarks.append("pictures of sand need a card: they are compared with the modes of its board")
    numbers = [number for number, peak in enumerate(picked.peaks) if peak.is_likely]
    peaks = [
        replace(peak, sign=picked.sign(answer, flips))
        for peak, answer in zip(picked.peaks, picked.mobilities, strict=True)
    ]
    stated_labels: dict[int, tuple[str, float]] = {}
    if labels is not None:
        for number, chances in zip(numbers, labels.probabilities, strict=True):
            peaks[number] = _with_labels(peaks[number], chances)
        stated_labels = _surest_labels({number: labels.label_to_state(i) for i, number in enumerate(numbers)})
    remarks += moved_hit_remarks(peaks, picked.spectra.duration)
    text = fragment_text(
        peaks,
        stated_labels,
        picked.spectra,
        files=names,
        name="" if prepared is None else prepared.board.setups[0].name,
        sensor_mass=sensor_mass,
    )
    return PickReport(
        format=1,
        files=names,
        n_hits=picked.spectra.n_records,
        n_places=len(picked.spectra.place_pairs),
        seconds=picked.spectra.duration,
        lowest_hz=picked.lowest,
        highest_hz=picked.highest,
        peaks=tuple(peaks),
        polarity="" if flips is None else "opposite" if flips else "same",
        board="" if prepared is None else prepared.board.name,
        fragment=text,
        remarks=tuple(remarks),
    )


def _with_labels(peak: PickedRow, chances: Mapping[str, float]) -> PickedRow:
    """A peak with its most probable labels."""
    label_chances = [LabelChance(*entry) for entry in chances.items() if entry[1] >= _LEAST_LABEL][:_MOST_LABELS]
    return replace(peak, labels=tuple(label_chances), unlabelled_probability=max(1.0 - sum(chances.values()), 0.0))


def _surest_labels(stated_labels: Mapping[int, tuple[str, float] | None]) -> dict[int, tuple[str, float]]:
    """Each label for the peak where its confidence is highest."""
    labels = {number: label for number, label in stated_labels.items() if label is not None}
    surest = {
        label: number for number, (label, _) in sorted(labels.items(), key=lambda entry: (entry[1][1], -entry[0]))
    }
    return {number: label for number, label in labels.items() if surest[label[0]] == number}


def _write(folder: Path, targets: Sequence[Path], summary: PickReport, picked: PickedModes) -> None:
    from bayesplate.report.recordings import write_recordings_page

    make_folder(folder / FIGURES_FOLDER)
    fragment, _, numbers = targets
    write_text(fragment, summary.fragment)
    write_text(numbers, json_text(summary))
    write_recordings_page(folder, summary, picked)
