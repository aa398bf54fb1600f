"""Titles of cards and names of recordings, whatever is in them: texts on pages, in figures and on a terminal."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner
from made_batches import HERTZ, TEMPLATE
from made_recordings import hits, write_wav
from payloads import DIRECTION_MARKS, EVERY, PAYLOADS
from read_pages import Read, faults, not_as_text

from bayesplate.cli import main
from bayesplate.recordings.contract import LabelChance, PickedRow, PickReport
from bayesplate.report import recordings as home
from bayesplate.report.style import Picture, stacked_panels

UNMEASURED = Path(__file__).parents[2] / "docs" / "cards" / "half-top-unmeasured.toml"
STEERS = ("\x1b[2J\x1b]0;owned\x07.wav", "a\nb.wav", "a\rb.wav", "\x9b31m.wav", "\u202egnp.wav", "=cmd()|' '!A0.wav")
"""Names of files: what clears a screen or names it, ends a line, goes back to its beginning, turns it around."""
SETUP_KEYS = {"spurious_probability", "peaks", "frequencies_hz", "label_confidence", "signs", "hammer", "attached"}


def steering(printed: str) -> str:
    """Everything in an output that could steer a terminal."""
    return "".join(c for c in printed if c != "\n" and (not c.isprintable() or c in DIRECTION_MARKS))


def figure_faults(folder: Path) -> list[str]:
    """Figures that are no pictures, or more than that."""
    found = []
    for path in sorted(folder.rglob("*.svg")):
        for element in ElementTree.parse(path).iter():
            kind = element.tag.rpartition("}")[2]
            asked = [name for name in element.attrib if name.rpartition("}")[2].startswith("on")]
            found += [f"{path.name}: {kind} {asked}"] if asked or kind in ("script", "foreignObject", "a") else []
    return found


def test_names_of_recordings_stay_texts(tmp_path):
    """On the page, in its figures and on the terminal; of the fragment they are a comment in one line.

    Recordings between as many places as names, picked by the command line.
    """
    names = [*STEERS, *(f"{one}.wav" for one in PAYLOADS if "$" in one and "/" not in one)]
    arguments = []
    for i, name in enumerate(names):
        force, heard = hits(np.random.default_rng(2 + i), [0.05], (0.02, 0.02))
        arguments.append(str(write_wav(tmp_path / name, 4000.0, force, heard)))
    for i in range(len(names)):
        arguments += ["--hammer", f"{20 + 10 * i},20"]
    out = tmp_path / "o\x1b[2J\x07\u202eut"
    result = CliRunner().invoke(main, ["pick", *arguments, "--highest", "200", "--out", str(out)])
    assert result.exit_code == 0, result.output
    fragment = (out / "setup.toml").read_text(encoding="utf-8")

    assert faults(Read((out / "recordings.html").read_text(encoding="utf-8"))) == []
    assert figure_faults(out) == []
    assert len(list((out / "figures").glob("*.svg"))) == 3
    assert steering(result.stdout + result.stderr) == steering(fragment) == ""
    assert "owned" in fragment.splitlines()[0]
    assert set(tomllib.loads(fragment)) == {"setup"}
    assert set(tomllib.loads(fragment)["setup"]) <= SETUP_KEYS
    assert steering("".join(json.loads((out / "pick.json").read_text(encoding="utf-8"))["files"])) == ""


def test_a_refused_name_stays_a_text(tmp_path):
    """Of a recording, a picture, a sweep, a card and a fragment: each stands in a message."""
    name = "\x1b[2J\u202e\n"
    for arguments in (
        ["pick", f"{tmp_path}/{name}.wav"],
        ["pick", f"{tmp_path}/a.{name}"],
        ["pick", "a.wav", "--sweep", name],
        ["pick", "a.wav", "--sand", f"100=a.{name}"],
        ["pick", "a.wav", "--polarity", name],
        ["check", f"{tmp_path}/{name}.toml"],
        ["check", "fiemme-spruce-clamped", "--setup", f"{tmp_path}/{name}.toml"],
        ["check", "fiemme-spruce-clamped", "--effects", name],
        ["batch", f"{tmp_path}/{name}.csv", "--template", "x"],
        ["fit", "fiemme-spruce-clamped", "--out", f"{tmp_path}/{name}", "--resume"],
    ):
        result = CliRunner().invoke(main, arguments)

        assert result.exit_code in (2, 3, 6), arguments
        assert steering(result.stdout + result.stderr) == "", arguments


ROW = PickedRow(52.0, 0.1, 0.1, 0.0, 0.0, 1.0, 0.1, "+", 1.0, 0.01, "", 1.0, 0.0)


def test_a_text_stays_a_text_on_the_page_of_recordings(tmp_path, monkeypatch):
    """Names of files, of the board, remarks, labels, and the fragment."""
    payload = EVERY
    for name in ("spectra", "errors", "stability"):
        picture = Picture(name, payload, payload, payload, stacked_panels([0.3])[0])
        monkeypatch.setattr(home, f"{name}_picture", lambda *_, picture=picture: picture)
    monkeypatch.setattr(home, "averaged_responses", lambda _: ())
    peaks = (ROW, PickedRow(**{**vars(ROW), "labels": (LabelChance(payload, 0.9),)}))
    report = PickReport(1, (payload, payload), 1, 1, 1.5, 20.0, 200.0, peaks, "same", payload, payload, (payload,))
    (tmp_path / "figures").mkdir()
    home.write_recordings_page(tmp_path, report, SimpleNamespace(paths=(), spectra=None))

    assert not_as_text((tmp_path / "recordings.html").read_text(encoding="utf-8"), payload, 9) == []
    assert figure_faults(tmp_path) == []


@pytest.mark.parametrize("command", ["check", "cite", "modes", "plan"])
def test_a_title_stays_a_text_in_figures_and_on_the_terminal(command, tmp_path):
    """And source and notes. In JSON, which programs read, it is what the card says."""
    text = "".join(f"{key} = {json.dumps(EVERY, ensure_ascii=False)}\n" for key in ("title", "source", "notes"))
    is_measured = command in ("check", "cite")
    readings = "".join(f'"{label}" = {hertz}\n' for label, hertz in HERTZ.items())
    measured = f"{TEMPLATE}\n[setup.frequencies_hz]\n{readings}"
    whole = measured if is_measured else UNMEASURED.read_text(encoding="utf-8")
    lines = [line for line in whole.splitlines() if not line.startswith(("title", "source", "notes"))]
    at = next(i for i, line in enumerate(lines) if line.startswith("name"))
    card = tmp_path / ("template.toml" if is_measured else UNMEASURED.name)
    card.write_text("\n".join([*lines[: at + 1], text, *lines[at + 1 :]]), encoding="utf-8")
    out = [] if is_measured else ["--out", str(tmp_path / "out")]
    result = CliRunner().invoke(main, [command, str(card), *out])

    assert result.exit_code == 0, result.output
    assert steering(result.stdout + result.stderr) == ""
    assert figure_faults(tmp_path) == []
    if command == "plan":
        assert json.loads((tmp_path / "out" / "plan.json").read_text(encoding="utf-8"))["title"] == EVERY


def test_what_steers_and_what_is_more_than_a_picture_is_found(tmp_path):
    """The negative control."""
    (tmp_path / "a.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg" onload="x()"><script/></svg>')

    assert figure_faults(tmp_path) == ["a.svg: svg ['onload']", "a.svg: script []"]
    assert steering("a\x1b[2Jb\n\u202ec") == "\x1b\u202e"
