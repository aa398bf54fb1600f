"""The [setup] fragment that `pick` writes: what a card takes of the recordings, in TOML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from bayesplate.board.units import SI, in_unit
from bayesplate.board.writing import toml_value
from bayesplate.recordings.contract import PickedRow

if TYPE_CHECKING:
    from bayesplate.recordings.signals import Place
    from bayesplate.recordings.spectra import Spectra

_LEAST_SD = 1e-5
"""Of a frequency, relative: no laboratory's clock is better."""
_HIGHEST_CONFIDENCE = 0.999
_LEAST_SPURIOUS, _MOST_SPURIOUS = 0.002, 0.5
_MOST_FILES = 3


def spurious_share(peaks: Sequence[PickedRow]) -> float:
    """Probability that any of some peaks is no mode, as a card states it, from that of each."""
    share = sum(peak.spurious_probability for peak in peaks) / max(len(peaks), 1)
    return min(max(share, _LEAST_SPURIOUS), _MOST_SPURIOUS)


def fragment_text(
    peaks: Sequence[PickedRow],
    labelled: Mapping[int, tuple[str, float]],
    spectra: Spectra,
    *,
    files: Sequence[str],
    name: str = "",
    sensor_mass: tuple[float, float] | None = None,  # kg, with its standard deviation
) -> str:
    """A [setup] with the likely peaks; `labelled`: stated label and confidence by number of the peak."""
    file_names = ", ".join([*files[:_MOST_FILES], *(["..."] if len(files) > _MOST_FILES else [])])
    lines = [f"# Picked from {file_names}. Use it with: bayesplate fit CARD --setup THIS_FILE", "[setup]"]
    if name:
        lines.append(f"name = {toml_value(name)}")
    likely = [(i, peak) for i, peak in enumerate(peaks) if peak.is_likely]
    unlabelled = [peak for i, peak in likely if i not in labelled]
    labelled_peaks = [(peak, *labelled[i]) for i, peak in likely if i in labelled]
    if unlabelled:
        lines.append(f"spurious_probability = {round(spurious_share([peak for _, peak in likely]), 4)}")
    if labelled_peaks:
        lines += ["", "[setup.frequencies_hz]"]
        lines += [f"{toml_value(label)} = {_frequency_text(peak)}" for peak, label, _ in labelled_peaks]
        lines += ["", "[setup.label_confidence]"]
        lines += [
            f"{toml_value(label)} = {round(min(confidence, _HIGHEST_CONFIDENCE), 3)}"
            for _, label, confidence in labelled_peaks
        ]
        signed = [(label, peak.sign) for peak, label, _ in labelled_peaks if peak.sign]
        if signed:
            lines += ["", "[setup.signs]", *(f"{toml_value(label)} = {toml_value(sign)}" for label, sign in signed)]
    for peak in unlabelled:
        lines += ["", f"[[setup.peaks]]{_label_comment(peak)}", f"hz = {_frequency_text(peak)}"]
        lines += [f"sign = {toml_value(peak.sign)}"] if peak.sign else []
        lines += [f"amplitude = {peak.amplitude:.3g}", f"damping_percent = {peak.damping_percent:.3g}"]
        lines.append(f"spurious_probability = {round(spurious_share([peak]), 4)}")
    return "\n".join([*lines, *_place_lines(spectra, sensor_mass)]) + "\n"


def _frequency_text(peak: PickedRow) -> str:
    sd = max(peak.sd_hz, _LEAST_SD * peak.hz)
    return toml_value({"mean": float(f"{peak.hz:.7g}"), "sd": float(f"{sd:.2g}")})


def _label_comment(peak: PickedRow) -> str:
    """Labels as a comment: the fit finds them anew."""
    if not peak.labels:
        return ""
    return "  # " + ", ".join(f"{chance.label} {100.0 * chance.probability:.0f} %" for chance in peak.labels[:2])


def _place_lines(spectra: Spectra, sensor_mass: tuple[float, float] | None) -> list[str]:
    """Hammer and accelerometer, as far as they are known and a card can say them."""
    hammers = list(dict.fromkeys(hammer for hammer, _ in spectra.place_pairs if hammer is not None))
    sensors = list(dict.fromkeys(sensor for _, sensor in spectra.place_pairs if sensor is not None))
    lines = []
    if len(hammers) == 1 and len(spectra.place_pairs) == 1:
        lines += ["", "[setup.hammer]", f"at_mm = {toml_value(_place_mm(hammers[0]))}"]
    if sensors and spectra.motion != "pressure":
        places = [_place_mm(sensor) for sensor in sensors]
        lines += ["", "[[setup.attached]]", 'kind = "accelerometer"']
        lines += [f"at_mm = {toml_value(places[0] if len(places) == 1 else places)}"]
        if sensor_mass is not None:
            mass, sd = sensor_mass
            grams = in_unit(mass, SI["g"])
            lines += [f"mass_g = {toml_value({'mean': grams, 'sd': in_unit(sd, SI['g'])} if sd else grams)}"]
    return lines


def _place_mm(place: Place) -> list[float]:
    return [float(f"{1e3 * value:.6g}") for value in place]
