"""What the package itself knows: effects, symbols, references, boards, exit codes, defaults, limits."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import bayesplate
from bayesplate import errors
from bayesplate.board.setup import CLAMPED_NOISE, DEFAULT_NOISE
from bayesplate.board.shelf import card_names
from bayesplate.campaign import evidence, likelihood, population, scatter
from bayesplate.campaign.claim import board_p_value
from bayesplate.campaign.search import PRIOR_SHARE_OF_TWO
from bayesplate.campaign.search import SHARING_PRIOR as WAYS_BEFORE
from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.claim import IMPROBABLE_BELOW, STANDARD_ERRORS
from bayesplate.diagnosis.folds import NEEDED_BELOW, NOT_NEEDED_ABOVE
from bayesplate.diagnosis.hypotheses import PRIOR_OF_NONE, PRIOR_OF_ONE, PRIOR_OF_TWO
from bayesplate.diagnosis.null_control import CHANCE_SHARE, FALSE_ALARMS, N_SETS
from bayesplate.diagnosis.search import LEAST_P_VALUE
from bayesplate.diagnosis.sensitivity import NOISE_FACTORS, PRIOR_WIDTH_FACTORS
from bayesplate.diagnosis.signatures import LOOK_ALIKE_COSINE
from bayesplate.diagnosis.sizes import LIMIT_PROBABILITY
from bayesplate.diagnosis.verdict import ALTERNATIVE_FACTOR, CLEAR_FACTOR
from bayesplate.effects import EFFECTS
from bayesplate.effects.words import join_words
from bayesplate.planning import bench, gains
from bayesplate.posterior.convergence import Gate
from bayesplate.results import references as cited
from computations.markdown import plain, table, words_table
from computations.runs import SOURCE

RESULTS = SOURCE / "validation"
CHECKS = (
    (
        "limits",
        "make limits",
        "Every acceptance limit of computation, convergence, long runs and security, with the worst that a test "
        "measured.",
    ),
    (
        "benchmarks",
        "make benchmarks",
        "What sampling and whole commands cost beside emcee as it comes, measured in one run, each with its limit.",
    ),
    (
        "peers",
        "make peers",
        "The six frequencies of a board by other samplers, each in an environment of its own: cold time to 4000 "
        "effective draws, effective draws per second, and how far each is from quadrature.",
    ),
    (
        "closing-the-loop",
        "python examples/closing_the_loop.py --out docs/validation",
        "Shipped boards through `diagnose`: the verdict, whether an improvement is claimed, errors in cents before and "
        "after, the shift of each constant in standard deviations, and what comes nearest where nothing explains the "
        "board.",
    ),
    (
        "plans",
        "make plans",
        "Simulated boards with two surviving explanations, measured as the plan says, at random, and by the next modes "
        "up: how often that settles which is true, and whether expected gains are realised.",
    ),
    (
        "spruce-half-tops",
        "python examples/campaign.py --out docs/validation --results results/spruce-half-tops",
        "Six half-tops of one laboratory through `diagnose`: what they share, and what boards left out say of it.",
    ),
    (
        "spruce-half-tops-shear",
        "python examples/campaign.py spruce-half-tops-shear --out docs/validation --results results/shear",
        "The same six with transverse shear alone shared.",
    ),
    (
        "spruce-half-tops-scatter",
        "python examples/campaign.py spruce-half-tops-scatter --out docs/validation --results results/scatter",
        "The same, each board's own shear differing from what they share by about 25 %.",
    ),
    (
        "spruce-half-tops-search",
        "python examples/campaign.py spruce-half-tops-search --out docs/validation --results results/search",
        "The same, nothing named as shared: what they have alike is searched for.",
    ),
    (
        "spruce-half-tops-set-aside",
        "python examples/campaign.py spruce-half-tops-set-aside --out docs/validation --results results/set-aside",
        "Four half-tops that were set aside until the rules of search and claim stood, tried unseen: what they share.",
    ),
    (
        "spruce-half-tops-all",
        "python examples/campaign.py spruce-half-tops-all --out docs/validation --results results/all",
        "All ten together.",
    ),
    (
        "campaigns",
        "make campaigns",
        "Simulated campaigns of eight boards: with one sensor and the shear of one species on all, intervals of "
        "its mass and of the shear moduli; with a sensor on three boards, or on none, how often it is claimed.",
    ),
    (
        "recordings",
        "make recordings",
        "Simulated hits on boards of another discretisation: how many picked frequencies lie within their standard "
        "errors, bias, false and missed modes, and a control that reads the highest line.",
    ),
    (
        "measured-recordings",
        "make measured",
        "Hits and frequency responses of two measured half-tops, against peaks that another method read off: which are "
        "found, which are new, and which modes of the board those are. The recordings are no part of the project.",
    ),
    (
        "batch",
        "make batch",
        "Simulated boards through `batch`, hundreds of them: time and memory by one worker, two, and a Dask cluster.",
    ),
    (
        "spectra",
        "make spectra",
        "Simulated free boards with two labels, missed modes and a spurious peak: probabilities of assignments, and "
        "intervals of the constants.",
    ),
    (
        "roving",
        "make roving",
        "Responses of a sensor at six places: each mode once, and constants that hold the truth.",
    ),
    (
        "sand",
        "make sand",
        "Pictures of sand, uneven, partial and askew: how often the right mode is the likeliest.",
    ),
    (
        "calibration",
        "make calibration",
        "Boards are drawn from the prior, measured with noise and fitted; if the inference is right, the truth falls "
        "everywhere in the posterior alike. Draws against closed forms, ranks at the paper's boards, and the joint "
        "distribution of constants and readings. Broken variants must be caught.",
    ),
    (
        "coverage",
        "make coverage",
        "How often a 90 % interval holds the truth when an effect was planted and declared.",
    ),
    (
        "two-setups",
        "make two-setups",
        "The same of boards that are measured clamped and free, where neither how much the clamp gives nor how far it "
        "grips is known: the free board tells its stiffness, and what is left is the clamp's.",
    ),
    (
        "trial",
        "make trial",
        "The diagnosis on trial: boards planted by an independent generator, with one effect, two, none, or one that "
        "the library does not know, judged blindly and counted.",
    ),
    ("trial-short", "make trial", "The same in a paragraph."),
    ("trial-again", "make trial-again", "The first boards of each of its cells, judged again: question by question."),
    ("trial-warp-exciter", "make trial-warp-exciter", "Boards that are not flat or that an exciter drives, on trial."),
)
"""Long checks: the stem of their page or printed output, the command that makes it, and what it shows."""
TITLES = {"trial-short": "The trial in short"}
"""Of long checks that their stem does not say in words."""


def _boards() -> list[str]:
    return list(card_names("boards"))


def effects_listed(folder: Path) -> str:
    """Every effect: what it says, what it belongs to, and the priors of what a card does not state."""
    entries = []
    for name, effect in EFFECTS.items():
        parameters = list(_parameters(name))
        priors = f"Parameters: {'; '.join(parameters)}." if parameters else "It has no parameter: it is as measured."
        entries.append(f"`{name}`\n: {effect.sentence} Belongs to the {effect.scope}.\n\n  {priors}\n")
    return "\n".join(entries)


def _parameters(name: str) -> Iterator[str]:
    """Parameters of an effect on the first shipped board that it can act on, as if the card stated none of them."""
    for card in _boards():
        board = replace(prepare(card, []).board, shear_xz=None, shear_yz=None)
        for form in EFFECTS[name].forms(board):
            by_source: dict[str, list[str]] = {}
            for parameter in form.effects[0].parameters():
                unit = "" if parameter.unit == "1" else f" in {parameter.unit}"
                by_source.setdefault(parameter.source, []).append(f"`{parameter.key}`{unit}")
            yield from (f"{', '.join(names)} ({source})" for source, names in by_source.items())
            return


def symbols(folder: Path) -> str:
    """The glossary of symbols, from the docstring of the package."""
    text = (bayesplate.__doc__ or "").partition("Glossary of symbols")[2]
    rows = []
    for line in text.splitlines():
        match = re.match(r"^(\S.*?)\s{2,}(\S.*)$", line)
        if match:
            rows.append((f"`{match[1]}`", match[2].replace("|", "\\|").replace("^", "\\^").replace("_", "\\_")))
    return words_table(("symbol", "meaning"), rows)


def reference(folder: Path, name: str) -> str:
    """One reference by the name it has in `bayesplate.results.references`."""
    return f"> {_unquoted(getattr(cited, name))}\n"


def references(folder: Path) -> str:
    """Every reference that a fit may give."""
    entries = [cited.PAPER, cited.ELEMENT]
    for group in ((cited.THIN_THEORY,), *(effect.references for effect in EFFECTS.values()), cited.COMPUTATION):
        entries += group
    return "\n".join(f"- {_unquoted(entry)}" for entry in dict.fromkeys(entries)) + "\n"


def planning_references(folder: Path) -> str:
    """What the plan rests on."""
    return "\n".join(f"- {_unquoted(entry)}" for entry in (*gains.REFERENCES, *bench.REFERENCES)) + "\n"


def campaign_references(folder: Path) -> str:
    """What boards that share something rest on: the references of the functions and files that do it."""
    documented = (likelihood, evidence, board_p_value, scatter, population)
    tails = ((one.__doc__ or "").split("References\n")[1].partition("\n")[2] for one in documented)
    return "\n".join(f"- {_unquoted(' '.join(tail.split()))}" for tail in tails) + "\n"


def _unquoted(entry: str) -> str:
    """A reference with its DOI as a link and its use in italics."""
    linked = re.sub(r"doi:(10\.\S+?)(?=[.,;]?(?:\s|$))", r"[doi:\1](https://doi.org/\1)", entry)
    return re.sub(r"\[([^\[\]]+)\]$", r"*\1*", linked)


def exit_codes(folder: Path) -> str:
    """Exit codes, from the tree of errors."""
    rows = [("0", "done, whatever the verdict"), ("2", "wrong use of the command line")]
    for name in ("InputError", "NotIdentifiableError", "NotConvergedError", "CheckpointError", "BatchError"):
        error = getattr(errors, name)
        rows.append((str(error.exit_code), (error.__doc__ or "").splitlines()[0].rstrip(".")))
    rows.append((str(errors.BayesplateError.exit_code), "internal error"))
    rows.append(("130", "interrupted; the message says whether `--resume` can go on"))
    return words_table(("code", "meaning"), rows)


def default_noise(folder: Path) -> str:
    """The default priors of the noise."""
    rows = [
        (words, f"{100 * noise.median:.1f}", f"{np.exp(noise.log_sd):.2f}")
        for words, noise in (("no edge clamped", DEFAULT_NOISE), ("an edge clamped", CLAMPED_NOISE))
    ]
    return table(("setup", "median, %", "factor"), rows)


def gate(folder: Path) -> str:
    """The limits of the convergence gate."""
    limits = Gate()
    rows = [
        ("split R-hat of the ensembles", f"at most {limits.rhat_max:g}"),
        ("length of each ensemble, in its autocorrelation times", f"at least {limits.tau_count_min:g}"),
        ("effective sample size", f"at least {limits.ess_min:g}"),
        ("mean acceptance", f"at least {limits.acceptance_min:g}"),
        ("acceptance of every walker", f"at least {limits.walker_acceptance_min:g}"),
    ]
    return words_table(("number", "limit"), rows)


_WAYS = {
    "none": "nothing is lacking",
    "shared": "an effect, or two, alike on all boards",
    "one board": "an effect on one board",
    "own": "an effect of another size on each board",
    "shared and own": "an effect alike on all boards beside another of another size on each",
}


def verdict_limits(folder: Path) -> str:
    """The numbers in the rules of the verdict."""
    rows = [
        ("an effect is needed: probability of no effect below", f"{NEEDED_BELOW:g}"),
        ("or larger odds against no effect than all but so many boards without any", f"{100 * FALSE_ALARMS:g} of 100"),
        ("but not with a probability of no effect above", f"{NOT_NEEDED_ABOVE:g}"),
        ("named: more probable than the next by a factor of", f"{CLEAR_FACTOR:g}"),
        ("group: within a factor of the best", f"{ALTERNATIVE_FACTOR:g}"),
        ("a pair counts if it beats its better member by a factor of", f"{CLEAR_FACTOR:g}"),
        ("prior predictive p-value, at least", f"{LEAST_P_VALUE:g}"),
        ("limit of a range: prior probability beyond the size, below", f"{LIMIT_PROBABILITY:g}"),
        ("look-alikes: cosine of the visible parts above", f"{LOOK_ALIKE_COSINE:g}"),
        ("prior probability of no effect, one, two", f"{PRIOR_OF_NONE:g}, {PRIOR_OF_ONE:g}, {PRIOR_OF_TWO:g}"),
        ("simulated boards of the null control, at most", f"{N_SETS}"),
        (
            "a name survives widths of the sizes' priors times",
            join_words([f"{one:g}" for one in PRIOR_WIDTH_FACTORS.values()]),
        ),
        ("and noises times", join_words([f"{one:.2g}" for one in NOISE_FACTORS.values()])),
        (
            "a claim: an effect chosen by chance lowers the leave-one-out error as far in fewer than",
            f"{100 * CHANCE_SHARE:g} of 100",
        ),
        ("a claim: standard errors by which the nested log score rises, more than", f"{STANDARD_ERRORS:g}"),
        (
            "a claim: probability of no effect, and of one that is not told, at their largest, below",
            f"{IMPROBABLE_BELOW:g}",
        ),
    ]
    return words_table(("rule", "number"), rows)


def campaign_limits(folder: Path) -> str:
    """The limits of what a search of a campaign says, and what is believed before."""
    rows = [
        ("least probability that nothing is lacking, for *none needed*", f"{IMPROBABLE_BELOW:g}"),
        ("how many times as probable as the next, for *named*", f"{CLEAR_FACTOR:g}"),
        *((f"probability before: {_WAYS[way]}", f"{before:g}") for way, before in WAYS_BEFORE.items()),
        (
            "share of what is alike beforehand that is two effects, where the boards can show two",
            f"{PRIOR_SHARE_OF_TWO:g}",
        ),
    ]
    return words_table(("limit", "value"), rows)


def long_checks(folder: Path) -> str:
    """Published results of the long checks: a page is linked, a table or what was printed is shown."""
    parts, pages = [], []
    known = {stem: f"{shows} Made by `{command}`{_measured(stem)}." for stem, command, shows in CHECKS}
    others = {path.stem: "" for path in sorted(RESULTS.glob("*.md")) if path.stem not in known}
    for stem, shows in {**known, **others}.items():
        page, output = RESULTS / f"{stem}.md", RESULTS / f"{stem}.txt"
        said = f"**{TITLES.get(stem, plain(stem).capitalize())}.** {shows}"
        if page.exists() and is_page(page):
            pages.append(f"{RESULTS.name}/{stem}")
            parts.append(f"{said} {{doc}}`What came out <{pages[-1]}>`.\n")
        elif page.exists():
            parts.append(f"{said}\n\n{page.read_text(encoding='utf-8').rstrip()}\n")
        elif output.exists():
            parts.append(f"{said}\n\n```text\n{output.read_text(encoding='utf-8').rstrip()}\n```\n")
        else:
            parts.append(f"{said} No result of it is published with this version.\n")
    if pages:
        parts.append("```{toctree}\n:hidden:\n\n" + "\n".join(pages) + "\n```\n")
    return "\n".join(parts)


def _measured(stem: str) -> str:
    """When a page was measured and on which tree, its parts apart where they were measured apart."""
    parts: dict[tuple[str, str], list[str]] = {}
    for name, entry in json.loads((RESULTS / "measured.json").read_text(encoding="utf-8")).items():
        page, _, part = name.partition(", ")
        if page == stem:
            parts.setdefault((entry["date"], entry["tree"]), []).append(part)
    told = []
    for (date, tree), names in sorted(parts.items()):
        which = f"{join_words(names)} " if any(names) else ""
        told.append(f"{which}on {date} (tree {tree})")
    return f"; measured {'; '.join(told)}" if parts else ""


def is_page(path: Path) -> bool:
    """Whether a file of results has a title of its own; a table alone is shown where it is spoken of."""
    return path.read_text(encoding="utf-8").startswith("# ")
