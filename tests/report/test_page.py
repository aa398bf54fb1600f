"""report.html as a parser reads it: everything is there, nothing is asked for, and texts stay texts."""

from __future__ import annotations

import re
from base64 import b64decode, b64encode
from dataclasses import replace
from hashlib import sha256
from xml.etree import ElementTree

import numpy as np
import pytest
from diagnoses import DIAGNOSES, NEXT, candidate, spread
from made_reports import FIGURES
from payloads import EVERY, PAYLOADS
from read_pages import Read, faults, not_as_text

from bayesplate.report.page import _diagnosis_pictures

LARGEST = 3_000_000
"""Bytes."""


@pytest.fixture(scope="module")
def page(clamped_folder):
    return Read((clamped_folder / "report.html").read_text(encoding="utf-8"))


def test_it_holds_every_figure_with_words_for_who_cannot_see_it(page, clamped_folder):
    images = page.all("img")
    names = [attributes["id"] for attributes in page.all("figure")]

    assert sorted(names) == sorted(FIGURES)
    assert {path.name for path in (clamped_folder / "figures").iterdir()} == {
        f"{name}.{ending}" for name in FIGURES for ending in ("png", "svg")
    }
    assert len(images) == len(FIGURES)
    for image in images:
        assert len(image["alt"]) > 40
        assert float(image["width"]) == pytest.approx(4.5 * 96)
    for name, image in zip(names, images, strict=True):
        assert b64decode(image["src"].partition(",")[2]) == (clamped_folder / "figures" / f"{name}.svg").read_bytes()
    assert (clamped_folder / "report.html").stat().st_size < LARGEST
    for path in sorted((clamped_folder / "figures").glob("*.svg")):
        tree = ElementTree.parse(path)
        titles = [one.text for one in tree.iter("{http://www.w3.org/2000/svg}title")]
        described = [one.text for one in tree.iter("{http://purl.org/dc/elements/1.1/}description")]
        assert titles, path.name
        assert all(titles), path.name
        assert len(described[0] or "") > 40
        assert path.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
        assert b"Description" in path.with_suffix(".png").read_bytes()


def test_it_keeps_to_itself(page):
    """No element but ours, no script, no address outside, and a policy that would stop one."""
    (policy,) = [m["content"] for m in page.all("meta") if m.get("http-equiv") == "Content-Security-Policy"]
    (style,) = re.findall(r"<style>(.*?)</style>", page.source, re.DOTALL)

    assert faults(page) == []
    digest = b64encode(sha256(style.encode()).digest()).decode()
    allowed = f"img-src data:; style-src 'sha256-{digest}'"
    assert policy == f"default-src 'none'; {allowed}; base-uri 'none'; form-action 'none'"
    assert "url(" not in style
    assert "@import" not in style


def test_it_says_what_the_summary_says(page, clamped):
    """The constants to two digits of their sd, every mode, the older methods, the seed, the versions."""
    summary = clamped.summary
    for name in ("E_x", "E_y", "G_xy"):
        mean, sd = summary.elastic[name].mean / 1e9, summary.elastic[name].sd / 1e9
        digits = 2 if sd >= 0.0995 else 3
        assert f"{mean:.{digits}f} ± {sd:.{digits}f}" in page.text
        assert f"{summary.least_squares[name] / 1e9:.{digits}f}" in page.text
    for mode in summary.modes:
        assert f"{mode.residual_cents:+.1f}" in page.text
    for sentence in (*summary.identifiability, *summary.warnings):
        assert re.sub(r"([EGD])_", r"\1", sentence).replace("nu_", "ν") in page.text
    assert summary.card_sha256 in page.text
    assert all(f"{name} {version}" in page.text for name, version in summary.versions.items())
    for words in ("wave speed", "radiation ratio", "specific stiffness", "impedance", "Ex / Ey"):
        assert words in page.text
    assert "scikit-fem" in page.text
    assert "Ducceschi" in page.text


def test_derived_quantities_by_hand(page, clamped):
    """c = sqrt(E / rho), c / rho, E / rho, c rho at 399 kg per cubic metre, from the mean modulus.

    The mean of a root lies below the root of the mean by an eighth of the relative variance, here less than 0.02 %.
    """
    E, rho = clamped.summary.elastic.E_x.mean, 399.0
    by_hand = {
        "wave_speed_x": np.sqrt(E / rho),
        "radiation_ratio_x": np.sqrt(E / rho) / rho,
        "specific_stiffness_x": E / rho,
        "impedance_x": np.sqrt(E / rho) * rho,
    }
    for name, value in by_hand.items():
        assert clamped.summary.derived[name].mean == pytest.approx(value, rel=5e-4), name


def test_a_text_stays_a_text(clamped):
    """In the title, the source, and what a diagnosis says: literally, without marks that turn the writing around.

    The negative control: the same page with its escapes undone would be noticed.
    """
    payload = EVERY
    told = candidate(payload, payload, look_alikes=(payload,), rejected_because=payload)
    found = replace(DIAGNOSES["named"], recommendation=payload, candidates=(told,), notes=(payload,))

    assert not_as_text(clamped.page(payload, payload, found), payload, 6) == []
    undone = clamped.page(PAYLOADS[4])
    for escape, sign in (("&lt;", "<"), ("&gt;", ">"), ("&#34;", '"'), ("&#39;", "'")):
        undone = undone.replace(escape, sign)
    assert "img onerror" in faults(Read(undone))


TOLD = {
    "none needed": ("need no further effect", "no more than their noise"),
    "named": ("An effect was found", "point to membrane tension.", "its low modes ring higher", "is reduced",
              "every condition of that claim is met", "fluid loading raises it from 46 to 94 cents",
              "What physics knows, computed and not fitted"),
    "indistinguishable group": ("cannot tell which: membrane tension or fluid loading.", "No improvement is claimed",
                                "with membrane tension, which is only one of the explanations. Quote the averaged"),
    "unexplained": ("Something is missing that was not found", "Check the labels"),
    "undetectable": ("These readings could not show it",),
}  # fmt: skip


@pytest.mark.parametrize("verdict", TOLD)
def test_each_verdict_is_told_in_plain_words(clamped, verdict):
    """The first lines are of the constants to quote: averaged, with the errors of the first fit unless one is named."""
    averaged = replace(spread(7.5e9), sd=0.75e9, q05=6.5e9, q95=8.5e9)
    found = DIAGNOSES[verdict]
    found = replace(found, elastic_averaged=found.elastic_averaged | {"E_x": averaged})
    page = Read(clamped.page("A board", diagnosis=found))
    text = " ".join(page.text.split())
    is_refitted, is_named = verdict in ("named", "indistinguishable group"), verdict == "named"

    for words in (*TOLD[verdict], NEXT, "6.50 to 8.50", "Log score: the natural logarithm"):
        assert words in text
    assert text.count("7.50 ± 0.75") == 2  # in short, and beside the older methods
    for words in ("Error before and after", "Shift of the constants", "Shift, sd: how far"):
        assert (words in text) == is_refitted
    seen = set(re.split(r"[<>\s]+", page.source))
    shifts = re.split(r"[<>\s]+", page.source.partition("Shift of the constants")[2])
    assert ("46.5" in seen, "9.5" in seen, "+2.5" in shifts) == (True, is_refitted, is_refitted)
    assert ("its visible part drowns in the noise" in text) == (verdict != "undetectable")
    assert ("is reduced" in text) == ("What physics knows" in text) == is_named

    first = " ".join(page.text.partition("Is the ideal plate")[0].split())
    assert "7.50 ± 0.75 GPa along the grain" in first
    assert ("averaged over everything that may be the case" in first) is (verdict != "unexplained")
    assert ("Elastic constants, averaged over all explanations" in text) is (verdict != "unexplained")
    assert ("too narrow" in first) is (verdict == "unexplained")
    assert ("by 4.2 cents" in first, "by 21 cents" in first) == (is_named, not is_named)

    listed = re.findall(r"<li( class=.given.)?>([a-z ]+): ", page.source)
    assert [word for _, word in listed] == list(TOLD)
    assert [word for marked, word in listed if marked] == [verdict]
    assert re.findall(r"\b[EGD]_[a-z]+", page.text) == []  # no symbol is left as it is typed


def test_a_page_recommends_nothing_where_nothing_is_recommended(clamped):
    silent = replace(DIAGNOSES["none needed"], recommendation="")
    assert "What to measure next" not in Read(clamped.page("A board", diagnosis=silent)).text


def test_a_diagnosis_brings_its_figures_tables_and_constants(clamped, tmp_path, monkeypatch):
    """Without the fit's own figures, whose drawing takes most of the time."""
    places = dict.fromkeys(("constants", "board", "modes", "errors", "folded"), ())
    monkeypatch.setattr(
        "bayesplate.report.page.fit_pictures",
        lambda draws, summary, diagnosis: {
            **places,
            **dict(zip(("diagnosis_first", "diagnosis_more"), _diagnosis_pictures(diagnosis), strict=True)),
        },
    )
    always = {"null-control", "signatures"}
    added = {
        "named": {"before-after", *always},
        "indistinguishable group": {"before-after", *always},
        "none needed": always,
        "undetectable": set(),
    }
    for verdict, figures in added.items():
        folder = tmp_path / verdict
        page = Read(clamped.write(folder, DIAGNOSES[verdict]).read_text(encoding="utf-8"))
        assert {path.stem for path in (folder / "figures").iterdir()} == figures, verdict
        assert len(page.all("img")) == len(figures), verdict
        assert (folder / "before-after.csv").exists(), verdict
        assert (folder / "known-effects.csv").exists() == (verdict == "named"), verdict
    rows = (tmp_path / "indistinguishable group" / "constants.csv").read_text(encoding="utf-8").splitlines()
    assert [float(row.split(",")[2]) for row in rows[1:]] == pytest.approx([10.25, 1.0, 0.5, 30.0, 2.5, 5.0])
