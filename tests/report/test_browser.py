"""report.html in a real browser: no complaint, no request, every figure there, nothing cut off, texts stay texts."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import Page, browser_path, running_browser
from diagnoses import DIAGNOSES
from payloads import PAYLOADS, shown

pytestmark = [
    pytest.mark.skipif(browser_path() is None, reason="no chromium on this machine: the page is only parsed"),
    pytest.mark.skipif(not Path("/bin/bash").exists(), reason="the browser is started through a shell's descriptors"),
]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """One page of a browser that all tests use."""
    path = browser_path()
    assert path is not None
    with running_browser(path, tmp_path_factory.mktemp("profile")) as browser:
        yield browser.new_page()


@pytest.fixture(scope="module")
def reports(clamped, clamped_folder, tmp_path_factory) -> dict[str, Path]:
    """A fit and a diagnosis."""
    folder = tmp_path_factory.mktemp("diagnosed")
    return {"fit": clamped_folder / "report.html", "diagnosis": clamped.write(folder, DIAGNOSES["named"])}


def outside(page: Page, own: Path) -> list[str]:
    """Everything that was asked for besides the page itself and what stands in it."""
    return [one for one in page.requests if not one.startswith("data:") and one != own.as_uri()]


@pytest.mark.parametrize(("which", "width"), [("diagnosis", 390), ("fit", 1280)])
def test_it_opens_whole_and_quiet(page, reports, which, width):
    own = reports[which]
    page.open(own.as_uri(), width)
    for is_open in (False, True):
        page.value(f"document.querySelectorAll('details').forEach(one => one.open = {str(is_open).lower()})")
        wide = page.value("document.documentElement.scrollWidth")
        assert wide <= width
        sizes = page.value("[...document.images].map(one => [one.naturalWidth, one.getBoundingClientRect().right])")
        assert len(sizes) == {"fit": 10, "diagnosis": 13}[which]
        assert all(natural > 0 and right <= width for natural, right in sizes)
        beyond = "[...document.querySelectorAll('main *')].filter(one => one.getBoundingClientRect().right > %d + 0.5)"
        assert page.value(beyond % width + ".map(one => one.outerHTML.slice(0, 80))") == []

    assert page.complaints == []
    assert outside(page, own) == []
    assert page.requests[0] == own.as_uri()


def test_words_are_large_enough_on_a_phone(page, reports):
    """Nothing below 11 pixels in the page; in a figure the smallest words, 6.5 points of 4.5 inches, above 6.5."""
    page.open(reports["fit"].as_uri(), 390)
    smallest = page.value(
        "Math.min(...[...document.querySelectorAll('p, td, th, li, figcaption, caption, summary')]"
        ".map(one => parseFloat(getComputedStyle(one).fontSize)))"
    )
    image = page.value("document.images[0].getBoundingClientRect().width")

    assert smallest >= 11
    assert 6.5 / 72 / 4.5 * image > 6.5


LETTER = (8.5, 11.0)


def test_a_fit_is_printed_on_two_sheets_and_a_verdict_adds_one(page, reports):
    """What is folded is not printed; what was opened comes after, on sheets of its own."""
    sheets = {}
    for which, own in reports.items():
        page.open(own.as_uri(), 1100)
        sheets[which] = page.printed(*LETTER)
    page.value("document.querySelector('#appendix details').open = true")

    assert sheets == {"fit": 2, "diagnosis": 3}
    assert page.printed(*LETTER) == 4


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_and_figures_are_legible_in_the_light_and_in_the_dark(page, reports, scheme):
    """Contrast of at least 4.5 between words and their ground; the dark lines of a figure keep a white ground."""
    page.open(reports["diagnosis"].as_uri(), 1100)
    page.prefer(scheme)
    ground = brightness(page.value("getComputedStyle(document.body).backgroundColor"))
    words = [
        brightness(page.value(f"getComputedStyle(document.querySelector('{one}')).color"))
        for one in ("h1", "figcaption", "td", ".quiet", ".verdicts li", ".given")
    ]
    figure = page.value("getComputedStyle(document.images[0]).backgroundColor")
    page.prefer("light")

    assert (ground > 0.5) == (scheme == "light")
    assert all((max(one, ground) + 0.05) / (min(one, ground) + 0.05) > 4.5 for one in words)
    assert figure == "rgb(255, 255, 255)"


def brightness(colour: str) -> float:
    """Relative luminance of a colour as browsers write it, 0 to 1, as the guidelines of the web define it."""
    parts = [int(one) / 255 for one in re.findall(r"\d+", colour)[:3]]
    red, green, blue = (one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


@pytest.mark.parametrize(("width", "columns"), [(390, 1), (1100, 2)])
def test_figures_use_the_width(page, reports, width, columns):
    page.open(reports["fit"].as_uri(), width)
    page.value("document.querySelectorAll('details').forEach(one => one.open = true)")
    widths = page.value("[...document.images].map(one => one.getBoundingClientRect().width)")

    assert all(0.9 * (width - 40) / columns - 32 < one <= width / columns for one in widths)


def test_the_style_is_let_in(page, reports):
    """Its hash stands in the policy: a page whose style was refused would have the browser's own margins."""
    page.open(reports["fit"].as_uri(), 1280)

    assert page.value("getComputedStyle(document.body).maxWidth") == "1080px"


def test_hostile_texts_appear_literally(page, clamped, tmp_path):
    for i, payload in enumerate(PAYLOADS):
        own = tmp_path / f"{i}.html"
        own.write_text(clamped.page(payload, payload), encoding="utf-8")
        page.open(own.as_uri(), 390)
        expected = " ".join(shown(payload).split())
        heading = page.value("document.querySelector('h1').textContent")
        source = page.value("document.querySelector('.source').textContent")

        assert " ".join(heading.split()) == expected
        assert " ".join(source.split()) == expected
        assert page.value("document.title") == " ".join(f"{shown(payload)}: elastic constants".split())
        assert page.value("document.documentElement.scrollWidth") <= 390
        assert page.value("document.scripts.length") == 0
        assert page.complaints == []
        assert outside(page, own) == []


def test_the_watch_would_notice(page, tmp_path):
    """The negative control: a page that asks another host, runs a script and is too wide is caught in all three."""
    own = tmp_path / "bad.html"
    own.write_text(
        "<!DOCTYPE html><title>x</title><img src='http://127.0.0.1:9/x.png'><div style='width: 2000px'>x</div>"
        "<script>console.error('owned')</script>",
        encoding="utf-8",
    )
    page.open(own.as_uri(), 390)

    assert any("owned" in complaint for complaint in page.complaints)
    assert outside(page, own) == ["http://127.0.0.1:9/x.png"]
    assert page.value("document.documentElement.scrollWidth") > 390
    assert page.value("document.images[0].naturalWidth") == 0
