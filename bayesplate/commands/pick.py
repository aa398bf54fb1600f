"""`pick`: recordings to frequencies with their uncertainty, labels, and the [setup] that a card takes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from bayesplate.commands.arguments import checked
from bayesplate.commands.fragment import fragment_text
from bayesplate.commands.options import FilePath, Force
from bayesplate.commands.pick_labels import label_peaks, pictures_of
from bayesplate.commands.pick_options import (
    CardOrNone,
    Channels,
    Files,
    Hammer,
    Highest,
    Lowest,
    MotionWord,
    OutOfPick,
    Polarity,
    Rate,
    Sand,
    Sensor,
    SensorMass,
    SweepOption,
    band,
    given_places,
    places_beside_files,
    require_on_board,
)
from bayesplate.commands.pick_words import moved_between_hits, show_pick
from bayesplate.commands.prepare import Prepared, prepare
from bayesplate.commands.shown import Shown
from bayesplate.errors import Fault, InputError, NotIdentifiableError, plain
from bayesplate.files import make_folder, require_new, write_text
from bayesplate.recordings.contract import LabelChance, PickedRow, PickReport
from bayesplate.recordings.picking import HIGHEST, LOWEST, Picked, pick_modes
from bayesplate.recordings.reading import read_recordings
from bayesplate.recordings.sand import read_picture
from bayesplate.recordings.signals import Recording
from bayesplate.recordings.sweeps import band_of, impulse_response, read_sweep
from bayesplate.recordings.taking import Heard, take, take_impulses
from bayesplate.results.contract import json_text
from bayesplate.results.folder import FIGURES

if TYPE_CHECKING:
    from bayesplate.arrays import Floats
    from bayesplate.recordings.hits import Hit
    from bayesplate.recordings.signals import Read

FRAGMENT, PAGE, SUMMARY = "setup.toml", "recordings.html", "pick.json"
_RATE_OFF = 1e-6
_LEAST_LABEL, _MOST_LABELS = 0.005, 4
"""Probability below which a label is not listed."""


@dataclass(frozen=True, eq=False, repr=False)
class PickResult:
    """What `pick` leaves.

    Attributes
    ----------
    summary : PickReport
    picked : Picked
        With the spectra.
    folder : Path or None
        Where its files are; None if none were asked for.
    """

    summary: PickReport
    picked: Picked
    folder: Path | None

    def __repr__(self) -> str:
        found = ", ".join(f"{peak.hz:.1f}" for peak in self.summary.likely[:8])
        return f"<PickResult of {', '.join(self.summary.files[:3])}: {len(self.summary.likely)} modes, Hz: {found}>"

    def shown(self) -> Shown:
        """Tables and sentences for a person."""
        return show_pick(self.summary)

    def _repr_html_(self) -> str:
        return self.shown().html("Picked modes")


@checked(places_beside_files, lambda given: band(given, LOWEST, HIGHEST))
def pick(
    files: Files,
    *,
    card: CardOrNone = None,
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
    out: OutOfPick = None,
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
        Frequency in Hz to a picture of sand, cropped to the board.
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
    targets = () if out is None else require_new(Path(out), (FRAGMENT, PAGE, SUMMARY), force=force)
    prepared = None if card is None else _one_setup(prepare(card, may_lack_frequencies=True))
    if prepared is not None:
        # a microphone may be beside the board, and is nowhere on a card
        require_on_board(prepared.card, hammer, () if motion == "pressure" else sensor, sensor_mass)
    pictures = {hertz: read_picture(path) for hertz, path in (sand or {}).items()}
    read = read_recordings(files, rate, channels, motion)
    read = [
        [replace(one, hammer=struck, sensor=listened) for one in own]
        for own, (struck, listened) in zip(read, given_places(hammer, sensor, read), strict=True)
    ]
    if sweep is None:
        heard = take(read, highest)
    else:
        impulses, (first, last) = _impulses(read, sweep, highest)
        lowest, highest = max(lowest, first), min(highest, last)
        heard = take_impulses(impulses, highest)
    picked = pick_modes(heard.spectra, lowest, highest)
    summary = _summary(files, heard, picked, prepared, polarity, pictures, sensor_mass)
    if out is not None:
        _write(Path(out), targets, summary, picked)
    return PickResult(summary, picked, None if out is None else Path(out))


def _one_setup(prepared: Prepared) -> Prepared:
    """A card whose labels are meant without doubt: it has one setup."""
    if len(prepared.board.setups) > 1:
        names = ", ".join(setup.name for setup in prepared.board.setups)
        raise InputError(Fault(prepared.board.name, "a card with one setup", names, "one card for the edges at hand"))
    return prepared


def _impulses(
    read: Sequence[Sequence[Read]], sweep: str, highest: float
) -> tuple[list[tuple[Recording, Hit]], tuple[float, float]]:
    """Impulse responses in place of recordings of a sweep, each as if the board had been hit once; and its band, Hz."""
    recordings = [one for own in read for one in own if isinstance(one, Recording) and one.force is None]
    wrong = [one.name for own in read for one in own if one not in recordings]
    if wrong:
        wanted = "one channel with the response to the sweep"
        raise InputError([Fault(name, wanted, "another kind of file", "leave --sweep out for hits") for name in wrong])
    played: list[Floats]
    if not os.path.exists(sweep):
        stated = read_sweep(sweep)
        played = [stated.signal(one.rate) for one in recordings]
    else:
        ((itself, *_),) = read_recordings([sweep], was_played=True)
        if not isinstance(itself, Recording):
            raise InputError(Fault(plain(sweep), "a recording of the sweep", "a frequency response"))
        off = [one for one in recordings if abs(one.rate / itself.rate - 1.0) > _RATE_OFF]
        if off:
            wanted = f"{itself.rate:g} Hz, as the sweep"
            raise InputError([Fault(f"{one.name} rate", wanted, f"{one.rate:g} Hz") for one in off])
        played = [itself.response] * len(recordings)
    found, faults = [], list[Fault]()
    for one, signal in zip(recordings, played, strict=True):
        try:
            found.append(impulse_response(one, signal, highest))
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    bands = [band_of(signal, one.rate) for one, signal in zip(recordings, played, strict=True)]
    return found, (max(first for first, _ in bands), min(last for _, last in bands))


def _summary(
    files: Sequence[FilePath],
    heard: Heard,
    picked: Picked,
    prepared: Prepared | None,
    polarity: str | None,
    pictures: Mapping[float, Floats],
    sensor_mass: tuple[float, float] | None,
) -> PickReport:
    names = tuple(plain(Path(one).name) for one in files)
    flips = None if polarity is None else polarity == "opposite"
    remarks = [*heard.remarks, *picked.remarks]
    labels = None
    if prepared is not None:
        shown, told = pictures_of(prepared.board, picked.likely, pictures)
        remarks += told
        try:
            labels = label_peaks(prepared.board, prepared.prior, picked, flips, shown)
            flips, remarks = labels.flips, [*remarks, *labels.doubts]
        except NotIdentifiableError as error:
            remarks.append(f"no labels: {error}")
    elif pictures:
        remarks.append("pictures of sand need a card: they are compared with the modes of its board")
    numbers = [number for number, peak in enumerate(picked.peaks) if peak.is_likely]
    peaks = [
        replace(peak, sign=picked.sign(answer, flips))
        for peak, answer in zip(picked.peaks, picked.answers, strict=True)
    ]
    named: dict[int, tuple[str, float]] = {}
    if labels is not None:
        for number, chances in zip(numbers, labels.probabilities, strict=True):
            peaks[number] = _labelled(peaks[number], chances)
        named = _each_once({number: labels.stated(i) for i, number in enumerate(numbers)})
    remarks += moved_between_hits(peaks, picked.spectra.duration)
    text = fragment_text(
        peaks,
        named,
        picked.spectra,
        files=names,
        name="" if prepared is None else prepared.board.setups[0].name,
        sensor_mass=sensor_mass,
    )
    return PickReport(
        format=1,
        files=names,
        n_hits=len(picked.spectra.names),
        n_places=len(picked.spectra.between),
        seconds=picked.spectra.duration,
        lowest_hz=picked.lowest,
        highest_hz=picked.highest,
        peaks=tuple(peaks),
        polarity="" if flips is None else "opposite" if flips else "same",
        board="" if prepared is None else prepared.board.name,
        fragment=text,
        remarks=tuple(remarks),
    )


def _labelled(peak: PickedRow, chances: Mapping[str, float]) -> PickedRow:
    """A peak with its most probable labels."""
    listed = [LabelChance(*one) for one in chances.items() if one[1] >= _LEAST_LABEL][:_MOST_LABELS]
    return replace(peak, labels=tuple(listed), unlabelled_probability=max(1.0 - sum(chances.values()), 0.0))


def _each_once(stated: Mapping[int, tuple[str, float] | None]) -> dict[int, tuple[str, float]]:
    """Each label for the peak that it is surest of."""
    named = {number: one for number, one in stated.items() if one is not None}
    surest = {label: number for number, (label, _) in sorted(named.items(), key=lambda one: (one[1][1], -one[0]))}
    return {number: one for number, one in named.items() if surest[one[0]] == number}


def _write(folder: Path, targets: Sequence[Path], summary: PickReport, picked: Picked) -> None:
    from bayesplate.report.recordings import write_recordings_page

    make_folder(folder / FIGURES)
    fragment, _, numbers = targets
    write_text(fragment, summary.fragment)
    write_text(numbers, json_text(summary))
    write_recordings_page(folder, summary, picked)
