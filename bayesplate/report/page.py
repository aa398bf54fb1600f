"""report.html: the results of a fit or a diagnosis with all figures; two pages on paper, readable on a phone."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

from bayesplate.board.board import Board
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.diagnosis.tables import write_diagnosis_tables
from bayesplate.files import make_folder, write_text
from bayesplate.posterior.draws import Draws
from bayesplate.report import content
from bayesplate.report.board import board_picture
from bayesplate.report.constants import constants_picture, percentiles_pictures
from bayesplate.report.corner_plot import corner_picture
from bayesplate.report.diagnosis import before_after_picture, null_picture, signatures_picture
from bayesplate.report.modes import (
    modes_pictures,
    predictive_picture,
    residuals_picture,
    shares_picture,
    spectrum_pictures,
)
from bayesplate.report.posterior import health_picture, priors_picture
from bayesplate.report.saving import matplotlib_defaults, save_pictures
from bayesplate.report.style import Picture
from bayesplate.report.verdict import (
    diagnosis_section,
    page_warnings,
    quoted_constants,
    quoted_summary,
    short_sentences,
)
from bayesplate.results.fit_tables import write_constants
from bayesplate.results.folder import FIGURES_FOLDER, PAGE_FILE
from bayesplate.results.references import references
from bayesplate.results.summary import Summary
from bayesplate.results.tables import escape, render, strip_control_characters

_PIXELS_AN_INCH = 96


class PagePicture(NamedTuple):
    """A picture on a page: its words, its size in pixels, and its SVG content as a data address."""

    picture: Picture
    size: tuple[int, ...]
    source: str


@matplotlib_defaults()
def write_report(folder: Path, card: Board, draws: Draws, summary: Summary, diagnosis: Diagnosis | None = None) -> Path:
    """Write report.html, its figures as PNG and SVG, and the tables for other programs; returns the path of the page.

    Files of an earlier report are replaced. With a diagnosis, `draws` and `summary` are those of the refitted model.
    """
    title = draws.problem.board.title or summary.name
    make_folder(folder)
    write_constants(folder, quoted_summary(summary, diagnosis), title)
    if diagnosis is not None:
        write_diagnosis_tables(folder, diagnosis, title)
    groups = fit_pictures(draws, summary, diagnosis)
    return save_page(
        folder / PAGE_FILE,
        groups,
        lambda page_pictures: fit_page(card, draws, summary, page_pictures, diagnosis),
    )


def save_page(
    path: Path, groups: Mapping[str, Sequence[Picture]], text: Callable[[Mapping[str, Sequence[PagePicture]]], str]
) -> Path:
    """Write a page, and its figures as PNG and SVG into the folder beside it; `groups` holds them by place on the page.

    The page embeds the SVG figures, and is written before the PNG files.
    """
    make_folder(path.parent / FIGURES_FOLDER)
    pictures = [picture for group in groups.values() for picture in group]
    svgs = save_pictures(pictures, path.parent / FIGURES_FOLDER, "svg")
    write_text(path, text({place: [_page_picture(p, svgs[p.name]) for p in group] for place, group in groups.items()}))
    save_pictures(pictures, path.parent / FIGURES_FOLDER, "png")
    return path


def fit_pictures(draws: Draws, summary: Summary, diagnosis: Diagnosis | None = None) -> dict[str, list[Picture]]:
    problem = draws.problem
    board = problem.board
    first, more = _diagnosis_pictures(diagnosis)
    return {
        "diagnosis_first": first,
        "diagnosis_more": more,
        "constants": [constants_picture(summary, draws.moduli)],
        "board": [board_picture(board)],
        "modes": modes_pictures(draws, summary),
        "errors": [*spectrum_pictures(summary), residuals_picture(summary)],
        "folded": [
            shares_picture(summary, problem.identifiability),
            *percentiles_pictures(draws),
            predictive_picture(summary, draws.predictive),
            priors_picture(draws),
            corner_picture(draws),
            health_picture(draws.inference),
        ],
    }


def _diagnosis_pictures(diagnosis: Diagnosis | None) -> tuple[list[Picture], list[Picture]]:
    if diagnosis is None:
        return [], []
    before_after = before_after_picture(diagnosis)
    appendix = [null_picture(diagnosis), signatures_picture(diagnosis)]
    return [before_after] if before_after else [], [picture for picture in appendix if picture]


def _page_picture(picture: Picture, svg: bytes) -> PagePicture:
    """A picture for a page, from the content of its SVG file."""
    from markupsafe import Markup

    size = tuple(round(_PIXELS_AN_INCH * side) for side in picture.figure.get_size_inches())
    # base64 needs no escape
    return PagePicture(picture, size, Markup(f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}"))


def fit_page(
    card: Board,
    draws: Draws,
    summary: Summary,
    pictures: Mapping[str, Sequence[PagePicture]],
    diagnosis: Diagnosis | None = None,
) -> str:
    problem = draws.problem
    board, prior = problem.board, problem.prior
    return render_page(
        "report.html",
        title=board.title or board.name,
        name=board.name,
        sentences=short_sentences(summary, diagnosis),
        warnings=page_warnings(summary, diagnosis),
        weak=summary.identifiability,
        effects=content.effect_sentences(summary, () if diagnosis is None else diagnosis.sentences),
        diagnosis=None if diagnosis is None else diagnosis_section(diagnosis),
        pictures=dict.fromkeys(PICTURE_PLACES, ()) | dict(pictures),
        tables={
            "constants": quoted_constants(summary, diagnosis),
            "effects": content.effects_table(board, summary),
            "makers": content.makers_table(summary),
            "ratios": content.ratios_table(summary),
            "laws": content.laws_table(summary),
            "budget": content.budget_table(draws, summary),
            "inputs": content.inputs_table(board, summary),
            "setups": content.setups_table(board),
            "modes": content.modes_tables(summary),
            "priors": content.priors_table(prior),
        },
        model=content.model_rows(summary),
        sampler=content.sampler_rows(summary),
        run=content.run_rows(summary),
        source=board.source.strip(),
        references=references(card, prior, board),
    )


PICTURE_PLACES = ("diagnosis_first", "diagnosis_more", "constants", "board", "modes", "errors", "folded")
"""Places of pictures on the page."""


def render_page(template: str, /, **values: Any) -> str:
    """A page from a template; every value is stripped of control characters, then escaped.

    Its content security policy allows its embedded pictures and its style sheet, and nothing else.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    def clean(value: Any) -> Any:
        return strip_control_characters(value) if isinstance(value, str) and not isinstance(value, Markup) else value

    loader = PackageLoader("bayesplate.report", "templates")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, finalize=clean)
    environment.filters["symbols"] = lambda text: Markup(escape(str(text), "html"))
    environment.globals["table"] = lambda table, kind="": Markup(render(table, "html", kind=kind))
    css = files("bayesplate.report").joinpath("templates/report.css").read_text(encoding="utf-8")
    digest = b64encode(sha256(css.encode("utf-8")).digest()).decode("ascii")
    policy = f"default-src 'none'; img-src data:; style-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'"
    # the style sheet is a file of the package, the only one that the policy allows
    return environment.get_template(template).render(policy=policy, css=Markup(css), **values)
