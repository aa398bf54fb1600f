"""`cite`: the references of what a fit uses, and of nothing else."""

from __future__ import annotations

import runs
from click.testing import CliRunner

from bayesplate.cli import main
from bayesplate.commands.cite import cite, cite_text
from bayesplate.effects import EFFECTS

CARD = """\
format = 1
name = "my-board"
source = "my bench"

[plate]
length_x_mm = 253
length_y_mm = 114
thickness_mm = 3
mass_g = 41

[material]
prior = "spruce"

[setup]
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }

[setup.frequencies_hz]
"(1,1)" = 150
"(2,0)" = 240
"(0,2)" = 330
"""


def cited(*arguments):
    result = CliRunner().invoke(main, ["cite", *arguments])
    assert result.exit_code == 0, result.stderr
    return " ".join(result.stdout.split())


def test_a_fit_of_the_papers_board():
    text = cited("finnish-spruce-cantilever")

    for wanted in (
        "M. Ducceschi, S. Duran, H. Tahvanainen, L. Ausiello",
        "Kirchhoff", "doi:10.1086/670067", "doi:10.21105/joss.02369", "doi:10.21105/joss.01143",
        "board finnish-spruce-cantilever:", "coefficients paper-cantilever:", "E_x (weakly-informative)",
    ):  # fmt: skip
        assert text.count(wanted) == 1, wanted
    assert "Mindlin" not in text
    assert "G_yz" not in text


def test_shear_cites_its_theory_in_place_of_the_thin_one():
    """The card gives the shear moduli itself, so that the effect's own prior is not used."""
    text = cited("finnish-spruce-cantilever", "--effects", "transverse_shear")

    assert "Mindlin" in text
    assert "Reissner" in text
    assert "Kirchhoff" not in text
    assert "G_yz" not in text


def test_what_the_card_does_not_state_is_cited_with_its_prior(tmp_path):
    path = tmp_path / "my-board.toml"
    path.write_text(CARD, encoding="utf-8")
    default, stated = cited(str(path), "--effects", "transverse_shear"), None
    path.write_text(CARD.replace('prior = "spruce"', 'prior = "spruce"\npoisson_xy = 0.4'), encoding="utf-8")
    stated = cited(str(path), "--effects", "none")

    assert "board my-board: my bench" in default
    assert "G_yz (transverse_shear): spruce, log-normal" in default
    assert "poisson_xy (spruce):" in default
    assert "poisson_xy (spruce):" not in stated
    assert "coefficients" not in stated


def test_plain_text_and_json_hold_the_same():
    sections = cite("fiemme-spruce-clamped")
    printed = CliRunner().invoke(main, ["cite", "fiemme-spruce-clamped", "--json"])

    assert runs.read_json(printed.stdout) == {s.title.lower(): list(s.entries) for s in sections}
    assert all(len(line) <= 100 for line in cite_text(sections).splitlines())
    assert [s.title for s in sections] == ["Model", "Computation", "Data", "Prior"]


def test_references_of_effects_are_cited_with_them():
    for name, effect in EFFECTS.items():
        for entry in effect.references:
            others = [other for other, one in EFFECTS.items() if other != name and entry in one.references]
            assert not others, f"{entry} stands in the files of {name} and {others}"
    assert "Mascia" in cited("finnish-spruce-cantilever", "--effects", "grain_angle")
