"""Calibrate the inference: `python tests/validation/calibration/run.py --workers 2 --out results/calibration.jsonl`.

Parts, each with its own file of records beside the one that is named: ranks of the truth among draws over a prior, with
the mutants that they must find out; the same ranks for further models; draws against closed forms; ranks at the paper's
two boards; the joint distribution of constants and readings. Prints what each found. Exit code 0: calibrated and every
mutant caught; 1: not, or not all of it was run; 2: usage. A run that was interrupted goes on where it stopped if it is
given the same file.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Container, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one simulation a core; before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation import measured
from validation.calibration import again, bare, campaign_ranks, joint, oracle
from validation.calibration.layouts import EFFECTS
from validation.calibration.mutants import FITTED
from validation.calibration.pictures import ALT, draw
from validation.calibration.records import Record, add_to, read_done
from validation.calibration.sbc import identity, simulate_one
from validation.calibration.study import Study, numbered
from validation.calibration.table import (
    COVERAGE_LEVEL,
    FAMILY_LEVEL,
    MUTANT_LEVEL,
    MUTANTS,
    NOT_COUNTED,
    family_p_value,
    family_words,
    is_calibrated,
    is_caught,
    rows,
    text,
)
from validation.calibration.truths import Design

FEWEST_OF_MUTANT = 60
"""Simulations in which every mutant is fitted, though some are found out by fewer."""
TITLE = "Calibration of the posterior"
ABOUT = (
    "Of ranks: band p is the chance that the ranks of a fit that is right leave the flat line as far somewhere, chi2 p "
    "that of a chi-squared of their histogram; beside them the mean rank, 0.5 if the fit is right, and how often the "
    "middle 50 and 90 % of the draws hold the truth. A part is right if the smallest band p times the number of "
    f"quantities, the family-wise p, is above {FAMILY_LEVEL:g}: of many quantities some leave their own 95 % band by "
    f"chance; the same of how often the middle holds the truth is to be above {COVERAGE_LEVEL:g}. A mutant is caught "
    f"if the first is below {MUTANT_LEVEL:g}; what is wrong in it by construction is not counted."
)
SECTIONS = {
    "ranks": (
        "Ranks of the truth among draws",
        "Constants, noise and the size of an effect drawn from their priors, readings from them, and the rank of each "
        "among the draws of the fit; a frequency that was not read and the log likelihood are ranked too. The law is "
        "the one that a user's fit chooses: where it is not linear, a surrogate of it is walked on and corrected. Each "
        "mutant is a wrong posterior that the same bands must find out.",
    ),
    "linear": (
        "Ranks under the linear law",
        "The same without an effect, readings and fit by one linear law: nothing but the sampler can be wrong.",
    ),
    "exact": (
        "Ranks under the exact law",
        "The same without an effect, every step under the exact law itself.",
    ),
    "both": (
        "Ranks of a joint fit",
        "One board held free, then clamped at one end: constants in common, noise of each setup its own. The law is "
        "the one that a user's fit chooses.",
    ),
    "sessions": (
        "Ranks of two sessions",
        "One board clamped twice, under the linear law: the discrepancies of its modes from the plate, of a scale that "
        "is drawn too, are in both sessions.",
    ),
    "bare": (
        "Ranks with bare peaks",
        "Four modes have a label, of twelve others each leaves a peak without one or none: one linear law, so that "
        "nothing but the sum over assignments and the sampler can be wrong. A wrong posterior is to be found out.",
    ),
    "campaign": (
        "Ranks of a campaign",
        "Three boards with constants of their own and one stiffness of the threads that they hang from: what they "
        "share, and a board under what all teach. One linear law is both the truth and the fit. A wrong campaign, in "
        "which every board counts twice, is to be found out by what is shared.",
    ),
    "oracle": (
        "Closed forms",
        "Data sets whose posterior is known: normal where the noise is known, Student's where it is not.",
    ),
    "boards": (
        "At the paper's boards",
        "Constants drawn from the posterior of a board and new readings from them: their rank among the draws that see "
        "both sets of readings.",
    ),
    "joint": (
        "Joint distribution",
        "Constants and readings drawn in turn, the constants by the sampler's own steps: moments against those of "
        "independent draws.",
    ),
}
"""Parts of the page: their titles and what they are."""


MODELS = {
    "linear": Design(law="fixed-linear", resolution=0.0),
    "exact": Design(),
    "both": Design(edges="both", law="auto"),
    "sessions": Design(edges="days", law="fixed-linear", resolution=0.0, n_walkers=32),
}
"""Models that are ranked without mutants, by the name of their part."""


def parts(sets: int, simulations: int, steps: int, ranked: int) -> dict[str, Study]:
    """The parts beside the ranks with mutants, of so many data sets of each kind, simulations at each board, steps,
    and simulations of each further model.
    """
    sets_of = [(kind, i) for i in range(sets) for kind in oracle.KINDS]
    at_boards = [(name, i) for i in range(simulations) for name in again.BOARDS]
    of_sets = [({"kind": kind, "set": i}, (kind, i)) for kind, i in sets_of]
    of_boards = [({"board": name, "simulation": i}, (name, i)) for name, i in at_boards]
    chains = [
        ({"mutant": mutant, "steps": steps}, (joint.N_CHAINS, steps, 1, mutant)) for mutant in ("", *joint.MUTANTS)
    ]
    models = {
        name: Study(simulate_one, identity(design), numbered(design, n=ranked), ranks_of)
        for name, design in MODELS.items()
    }
    return models | {
        "bare": Study(
            bare.simulate_one,
            bare.identity(),
            numbered(n=ranked),
            lambda records: judge(list(records), {bare.HALF_NOISE: ranked}),
        ),
        "campaign": Study(
            campaign_ranks.simulate_one,
            campaign_ranks.identity(),
            numbered(n=ranked),
            lambda records: judge(list(records), {campaign_ranks.TWICE: ranked}),
        ),
        "oracle": Study(oracle.check_one, oracle.identity(), of_sets, oracle.judge),
        "boards": Study(again.simulate_again, again.identity(), of_boards, again.judge),
        "joint": Study(joint.check_one, joint.identity(), chains, joint.judge),
    }


def run(
    design: Design, n_simulations: int, n_mutants: int, workers: int, out: Path, *, quiet: bool = False
) -> list[dict[str, Any]]:
    """Do the ranks that are not done yet, and return the records of all simulations asked for, in their order.

    Without workers nothing is done, and those that were done before are returned.
    """
    records = read_done(out, identity(design))
    done = {r["simulation"]: {*r.get("ranks", FITTED), *r.get("refused", ())} for r in records}
    wanted = [(i, fitted_mutants(i, n_mutants)) for i in range(n_simulations)]
    jobs = [(design, i, names) for i, names in wanted if i not in done or not done[i].issuperset(names)]
    records += add_to(out, simulate_one, jobs, workers, quiet=quiet) if jobs and workers else []
    latest = {record["simulation"]: record for record in records if record["simulation"] < n_simulations}
    return [latest[i] for i in sorted(latest)]


def ranks_of(records: Sequence[Record]) -> tuple[list[str], bool]:
    """Paragraphs on the ranks of simulations, no mutant asked for, and whether all is well."""
    return judge(list(records), {})


def fitted_mutants(index: int, n_mutants: int) -> tuple[str, ...]:
    """The mutants that are fitted in a simulation: each in no more than it takes to find it out."""
    return tuple(name for name in FITTED if index < min(n_mutants, max(MUTANTS[name], FEWEST_OF_MUTANT)))


def judge(records: list[dict[str, Any]], wanted: Mapping[str, int] = MUTANTS) -> tuple[list[str], bool]:
    """Paragraphs to print, and whether all is well, the mutants that are wanted caught by so many simulations."""
    failed = [r for r in records if "error" in r]
    good = [r for r in records if "ranks" in r]
    paragraphs = []
    if failed:
        paragraphs.append(f"{len(failed)} simulations gave no draws; the first: {failed[0]['error']}")
    if not good:
        return paragraphs, False
    table = rows([r["ranks"]["production"] for r in good])
    well = is_calibrated(table) and not failed
    paragraphs.append(text("production", table, len(good)))
    paragraphs.append(
        f"  {family_words(table)}; relabelled at a veering: {sum(r['relabelled'] for r in good)}; "
        f"started anew: {sum(r['attempts'] > 1 for r in good)}; linear law: {sum(r['law'] == 'linear' for r in good)}; "
        f"median {sorted(r['seconds'] for r in good)[len(good) // 2]:.1f} s"
    )
    same = [r["ranks"]["production"] for r in good if not r["relabelled"]]
    if same and len(same) < len(good):
        paragraphs.append(f"  of those not relabelled, {len(same)}, {family_words(rows(same))}")
    for mutant, fewest in wanted.items():
        ranks = [r["ranks"][mutant] for r in good if mutant in r["ranks"]]
        if len(ranks) < fewest:
            paragraphs.append(f"mutant: {mutant}: {len(ranks)} simulations, {fewest} are needed to judge")
            well = False
            continue
        found = rows(ranks)
        caught = is_caught(mutant, found)
        well &= caught
        paragraphs.append(text(f"mutant: {mutant}", found, len(ranks)))
        p = family_p_value(found, NOT_COUNTED.get(mutant, ()))
        refused = sum(mutant in r.get("refused", ()) for r in good)
        told = f"; {refused} more refused by the package" if mutant in FITTED and refused else ""
        paragraphs.append(f"  {'caught' if caught else 'NOT CAUGHT'}, family-wise p {p:.1e}{told}")
    return paragraphs, well


def page(found: dict[str, list[str]], before: str = "", pictures: Container[str] = ()) -> str:
    """What was found as a page of the documentation.

    Of a part that was not run the page says what it said before, word for word; one that never was says so and
    nothing else.

    Parameters
    ----------
    found : dict of list of str
        Lines of the parts that were run.
    before : str
        The page as it was.
    pictures : container of str
        Parts of which there is a picture beside the page.
    """
    head = f"# {TITLE}\n\nWritten by `make calibration`; do not edit. Each part stands as it was last run.\n\n{ABOUT}\n"
    kept = dict(block.split("\n", 1) for block in before.split("\n## ")[1:])
    parts_of_page = [head]
    for name, (title, what) in SECTIONS.items():
        if name not in found and title in kept:
            parts_of_page.append(f"## {title}\n{kept[title].rstrip()}\n")
            continue
        told = "Not run with this version."
        if name in found:
            told = "\n".join(["```text", *"\n".join(found[name]).splitlines(), "```"])
        shown = f"\n![{ALT}]({picture_of(name)})\n" if name in pictures else ""
        parts_of_page.append(f"## {title}\n\n{what}\n\n{told}\n{shown}")
    return "\n".join(parts_of_page)


def picture_of(name: str) -> str:
    """File of a part's picture."""
    return f"calibration-{name}.png"


def publish(folder: Path, found: dict[str, list[str]], records: Mapping[str, Sequence[Record]]) -> None:
    """Write the page of what was found and the pictures of its ranks; of parts that were not run both stay."""
    folder.mkdir(parents=True, exist_ok=True)
    told = folder / "calibration.md"
    for name, of_part in records.items():
        draw(of_part, folder / picture_of(name))
    before = told.read_text(encoding="utf-8") if told.exists() else ""
    pictures = [name for name in SECTIONS if (folder / picture_of(name)).exists()]
    told.write_text(page(found, before, pictures), encoding="utf-8")


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=tuple(SECTIONS), default=list(SECTIONS),
                        help="what is computed; of the others what was done before is told")  # fmt: skip
    parser.add_argument("--simulations", type=int, default=1000, help="of the ranks")
    parser.add_argument(
        "--mutants", type=int, default=1000, help="simulations in which mutants are fitted too, at most"
    )
    parser.add_argument("--ranked", type=int, default=1000, help="simulations of each further model")
    parser.add_argument("--sets", type=int, default=oracle.N_SETS, help="of each kind of closed form")
    parser.add_argument("--at-boards", type=int, default=again.N_SIMULATIONS, help="simulations at each of two boards")
    parser.add_argument("--steps", type=int, default=joint.N_STEPS, help="of the joint distribution")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True, help="JSON lines; gone on with if it exists")
    parser.add_argument("--edges", choices=("free", "cantilever"), default="free")
    parser.add_argument(
        "--generator", choices=("package", "ritz"), default="package", help="whose frequencies are true"
    )
    parser.add_argument("--law", choices=("exact", "auto", "fixed-linear"), default="auto")
    parser.add_argument("--resolution", type=float, default=1.0, help="Hz; 0 for readings that are not rounded")
    parser.add_argument("--without-effect", action="store_true", help="no size of an effect among the ranks")
    parser.add_argument("--base-seed", type=int, default=1)
    parser.add_argument("--publish", type=Path, help="folder for a page of the parts that were computed")
    arguments = vars(parser.parse_args())
    if arguments["generator"] == "ritz" and not arguments["without_effect"]:
        parser.error("the independent solver knows no effects: --without-effect")
    effect = "" if arguments["without_effect"] else EFFECTS[arguments["edges"]]
    design = Design(effect=effect, **{f.name: arguments[f.name] for f in fields(Design) if f.name in arguments})
    started = time.perf_counter()
    out, workers = arguments["out"], arguments["workers"]
    found: dict[str, list[str]] = {}
    every: dict[str, list[Record]] = {}
    well = True
    if "ranks" in arguments["parts"] or out.exists():
        at_work = workers if "ranks" in arguments["parts"] else 0
        every["ranks"] = run(design, arguments["simulations"], arguments["mutants"], at_work, out)
        found["ranks"], is_right = judge(every["ranks"])
        well &= is_right
    counts = (arguments[name] for name in ("sets", "at_boards", "steps", "ranked"))
    for name, part in parts(*counts).items():
        beside = out.with_name(f"{out.stem}-{name}{out.suffix}")
        records = part.run(beside, workers) if name in arguments["parts"] else part.done(beside)
        if records:
            every[name] = records
            found[name], is_right = part.judge(records)
            well &= is_right
    well &= set(found) == set(SECTIONS)
    for name, lines in found.items():
        print(f"{SECTIONS[name][0]}\n" + "\n".join(lines))
    if arguments["publish"]:
        asked = [name for name in arguments["parts"] if name in found]
        publish(arguments["publish"], {name: found[name] for name in asked}, {name: every[name] for name in asked})
        measured.note(arguments["publish"], *(f"calibration, {name}" for name in asked))
    print(f"{'calibrated' if well else 'NOT CALIBRATED'}, {(time.perf_counter() - started) / 60:.1f} minutes")
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
