"""`cite`: the references of what a fit uses, and of nothing else."""

from __future__ import annotations

import runs
from click.testing import CliRunner

from bayesplate import Board, Setup
from bayesplate.cli import main
from bayesplate.commands.cite import cite, cite_text
from bayesplate.effects import EFFECTS

PAPER = "finnish-spruce-cantilever"
OF_THE_PAPER = (
    "M. Ducceschi, S. Duran, H. Tahvanainen, L. Ausiello",
    "Kirchhoff", "doi:10.1086/670067", "doi:10.21105/joss.02369", "doi:10.21105/joss.01143",
    "board finnish-spruce-cantilever:", "coefficients paper-cantilever:", "E_x (weakly-informative)",
)  # fmt: skip


def cited(card, *effects):
    return " ".join(cite_text(cite(card, effects=effects)).split())


def own(**stated):
    """A board of the user's own under the prior of spruce."""
    free = Setup.from_frequencies({"(1,1)": 150, "(2,0)": 240, "(0,2)": 330}, edges="free")
    sizes = {"length_x": 0.253, "length_y": 0.114, "thickness": 3e-3, "mass": 0.041}
    return Board.from_numbers("my-board", **sizes, prior="spruce", source="my bench", setups=free, **stated)


def test_exactly_what_a_fit_uses_is_cited():
    """Shear has its theory in place of the thin one; a prior is cited of what the card does not state alone."""
    thin, sheared, turned = (cited(PAPER, *effects) for effects in ((), ("transverse_shear",), ("grain_angle",)))
    default, stated = cited(own(), "transverse_shear"), cited(own(poisson_xy=0.4))

    assert [thin.count(wanted) for wanted in OF_THE_PAPER] == [1] * len(OF_THE_PAPER)
    for text, is_there, is_not in (
        (thin, (), ("Mindlin", "Mascia", "G_yz")),
        (sheared, ("Mindlin", "Reissner"), ("Kirchhoff", "G_yz")),  # the card gives the shear moduli itself
        (turned, ("Mascia",), ("Mindlin",)),
        (default, ("board my-board: my bench", "G_yz (transverse_shear): spruce, log-normal", "poisson_xy (spruce):"),
         ("coefficients",)),
        (stated, ("Kirchhoff",), ("poisson_xy (spruce):", "coefficients")),
    ):  # fmt: skip
        assert [word for word in is_there if word not in text] == []
        assert [word for word in is_not if word in text] == []


def test_plain_text_and_json_hold_the_same():
    sections = cite("fiemme-spruce-clamped")
    plain, mirrored = (CliRunner().invoke(main, ["cite", "fiemme-spruce-clamped", *more]) for more in ([], ["--json"]))

    assert plain.stdout == cite_text(sections)
    assert runs.read_json(mirrored.stdout) == {s.title.lower(): list(s.entries) for s in sections}
    assert all(len(line) <= 100 for line in plain.stdout.splitlines())
    assert [s.title for s in sections] == ["Model", "Computation", "Data", "Prior"]


def test_no_reference_stands_in_the_files_of_two_effects():
    for name, effect in EFFECTS.items():
        for entry in effect.references:
            others = [other for other, one in EFFECTS.items() if other != name and entry in one.references]
            assert not others, f"{entry} stands in the files of {name} and {others}"
