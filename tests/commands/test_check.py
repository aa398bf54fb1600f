"""`check`: what a card can identify, its faults, and nothing sampled or written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from runs import read_json

import bayesplate
from bayesplate.board.shelf import card_names
from bayesplate.cli import main
from bayesplate.results.contract import as_json

CANTILEVER = """\
format = 1
name = "my-board"
[plate]
length_x_mm = 253
length_y_mm = 114
thickness_mm = 3
density_kg_m3 = 473.9
[material]
poisson_xy = 0.51
[setup]
name = "cantilever"
edges = { x0 = "clamped", x1 = "free", y0 = "free", y1 = "free" }
clamped_mm = { x0 = 30 }
first_label = [1, 0]
resolution_hz = 1
"""
PEAKS = {"(1,0)": 52, "(1,1)": 98, "(2,0)": 310, "(1,2)": 337, "(2,1)": 398, "(2,2)": 637}


@pytest.fixture
def with_labels(tmp_path: Path) -> Callable[..., Path]:
    """The paper's cantilever board with some of its modes only."""

    def write(*labels: str) -> Path:
        path = tmp_path / "my-board.toml"
        table = "".join(f'"{label}" = {PEAKS[label]}\n' for label in labels)
        path.write_text(f"{CANTILEVER}[setup.frequencies_hz]\n{table}", encoding="utf-8")
        return path

    return write


@pytest.fixture
def without_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaves out what effects would do to the board: half of the work, and not what these tests look at."""
    monkeypatch.setattr("bayesplate.commands.check.signatures", lambda _: [])


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(main, arguments)


@pytest.mark.usefixtures("without_effects")
def test_the_report_printed_is_the_one_returned_and_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = bayesplate.check("finnish-spruce-cantilever")
    monkeypatch.setattr("bayesplate.commands.check.dispatch_card", lambda *_, **__: found)  # it is not computed again
    told, mirrored = (invoke("check", "finnish-spruce-cantilever", *option) for option in ((), ("--json",)))

    assert (told.exit_code, mirrored.exit_code) == (0, 0)
    assert read_json(mirrored.stdout) == as_json(found)
    assert all(label in told.stdout for label in PEAKS)
    assert "exact law; nothing was sampled" in told.stdout
    assert found.n_doubts == 0
    assert "Next: bayesplate fit" in found._repr_html_()
    assert list(tmp_path.iterdir()) == []


QUICK = ("finnish-spruce-cantilever", "acrylic-panel")
"""Fields of thickness and outline, and labels that have to be found, make others dear."""
BOARDS = [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in card_names("boards")]

ISOTROPIC = {"acrylic-panel", "foam-panel-exciter", "steel-air-water"}


@pytest.mark.parametrize("name", BOARDS)
def test_every_shipped_board_can_be_checked(name):
    """Leverages sum to the number of constants, energy shares to the whole, less what a support that bounces takes.

    So does the spring of an exciter, by no closed formula: that board is checked without it, too.
    """
    checked = bayesplate.check(name)
    if "exciter" in (declared := checked.problem.posed.board.effects):
        assert all(sum(mode.share_percent) < 100.2 for mode in checked.modes)
        checked = bayesplate.check(name, effects=[one for one in declared if one != "exciter"])
    report = as_json(checked)
    (bounce, *_) = [0.0 if setup.bounce is None else setup.bounce.median for setup in checked.problem.board.setups]

    n_constants = 1.0 if name in ISOTROPIC else 3.0
    assert sum(mode["leverage"] for mode in report["modes"]) == pytest.approx(n_constants, abs=1e-9)
    for mode in report["modes"]:
        taken = 100.0 * (bounce / mode["measured_hz"]) ** 2
        assert sum(mode["share_percent"]) == pytest.approx(100.0 - taken, abs=0.2)  # each is rounded to 0.1
    squares = [mode["residual_cents"] ** 2 for mode in report["modes"]]
    assert report["in_sample_rms_cents"] == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-12)


@pytest.mark.usefixtures("without_effects")
def test_a_board_of_peaks_alone_gets_labels_proposed():
    """nemus-D: the lowest modes of a cantilever, in each of three sessions."""
    report = bayesplate.check("nemus-D")

    labels = ["(1,0)", "(1,1)", "(2,0)", "(2,1)", "(1,2)", "(2,2)"]
    for session in ("session-1", "session-2", "session-3"):
        assert [mode.label for mode in report.modes if mode.setup == session] == labels


@pytest.mark.usefixtures("without_effects")
def test_the_expected_precision_is_that_of_the_noise(with_labels):
    """Doubling a noise that the residuals do not exceed doubles what is expected; the estimate stays."""
    card = with_labels(*PEAKS)
    text = card.read_text(encoding="utf-8").replace("resolution_hz = 1\n", "")  # rounding would add to the noise
    reports = []
    for median in (2.0, 4.0):
        noise = f"noise_percent = {{ median = {median}, factor = 1.65 }}\n[setup.frequencies_hz]"
        card.write_text(text.replace("[setup.frequencies_hz]", noise), encoding="utf-8")
        reports.append(bayesplate.check(card))
    low, high = reports

    for name in ("E_x", "E_y", "G_xy"):
        ratio = high.expected_sd_percent[name] / low.expected_sd_percent[name]
        assert ratio == pytest.approx(2.0, rel=0.01)  # moduli follow from rigidities by a slightly curved map
        assert high.estimate[name] == pytest.approx(low.estimate[name], rel=1e-9)


@pytest.mark.usefixtures("without_effects")
def test_what_is_in_doubt_is_to_be_settled_before_a_fit(with_labels):
    card = with_labels(*PEAKS)
    card.write_text(card.read_text(encoding="utf-8").replace('"(2,1)" = 398', '"(2,1)" = 796'), encoding="utf-8")
    doubted = bayesplate.check(card)

    assert doubted.n_doubts == 2  # the reading, and the scatter that it makes
    assert "(2,1)" in doubted.notes[0]
    assert "Next: settle what is in doubt above" in doubted._repr_html_()


@pytest.mark.usefixtures("without_effects")
def test_the_missing_direction_and_the_mode_that_would_help_are_named(with_labels):
    """(1,0), (1,1) and (2,1) of a cantilever bend along x and twist: D_y is free; with (1,2) it is not."""
    refused = invoke("check", str(with_labels("(1,0)", "(1,1)", "(2,1)")))
    message = refused.stderr

    assert refused.exit_code == 4
    assert "determine D_y (so E_y)" in message
    assert "condition number" in message
    assert "add a mode that bends across the grain" in message
    assert "D_x (so E_x)" not in message
    assert "D_s (so G_xy)" not in message
    assert invoke("check", str(with_labels("(1,0)", "(1,1)", "(2,1)", "(1,2)"))).exit_code == 0
