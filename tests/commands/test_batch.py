"""Many boards: the same bytes whoever computes them and however often a run is killed; one bad card stops nothing."""

from __future__ import annotations

import csv
import errno
import io
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from made_batches import TEMPLATE, card_text, write_cards
from made_summaries import SUMMARY
from runs import files_in

import bayesplate
from bayesplate.board.board import Board
from bayesplate.board.named import load_named_cards
from bayesplate.board.prior import PriorCard, load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.cli import main
from bayesplate.commands.batch import default_batch_folder
from bayesplate.commands.batch_boards import list_boards
from bayesplate.commands.batch_run import BatchRun
from bayesplate.errors import BatchError, InputError
from bayesplate.grading.boards import BoardRow
from bayesplate.results.contract import json_text

WHY = "correct their cards or rows: --resume then fits these alone"


def rows_of(table: bytes) -> dict[str, dict[str, str]]:
    """The rows of a CSV table by the name of the board."""
    return {row["name"]: row for row in csv.DictReader(io.StringIO(table.decode()))}


@pytest.fixture(scope="module")
def cards(tmp_path_factory) -> Path:
    """Three boards, two bad cards, and a prior card beside them."""
    folder = write_cards(tmp_path_factory.mktemp("cards") / "tops")
    (folder / "own-prior.toml").write_text(load_prior("spruce").to_toml().replace('"spruce"', '"own-prior"'))
    return folder


@pytest.fixture(scope="module")
def two(cards, tmp_path_factory) -> bayesplate.BatchResult:
    """Its batch by two workers."""
    limits = bayesplate.GradingRequest(limits={"E_x": (5e9, 20e9)}, rigidity=25.0)
    return bayesplate.batch(cards, tmp_path_factory.mktemp("two") / "out", workers=2, grading=limits)


@pytest.fixture(scope="module")
def one(cards, tmp_path_factory):
    """The same by one worker and the command line, with each board's own files."""
    out = tmp_path_factory.mktemp("one") / "out"
    options = ["--workers", "1", "--limit", "E_x=5:20", "--rigidity", "25", "--folders", "--no-report"]
    return CliRunner().invoke(main, ["batch", str(cards), "--out", str(out), *options]), out


def test_what_is_no_board_card_is_left_aside(tmp_path):
    """A prior card, and what `pick` writes; a card that lacks its plate is a bad card, not another kind."""
    (tmp_path / "own-prior.toml").write_text(load_prior("spruce").to_toml().replace('"spruce"', '"own-prior"'))
    (tmp_path / "setup.toml").write_text('[setup.frequencies_hz]\n"(1,1)" = 50.0\n')
    (tmp_path / "unfinished.toml").write_text('format = 1\nname = "unfinished"\n[setup]\n')
    boards, aside = list_boards(tmp_path, None)

    assert aside == ("own-prior.toml", "setup.toml")
    assert [board.name for board in boards] == ["unfinished"]


def test_a_folder_that_cannot_be_read_is_refused(tmp_path, monkeypatch):
    def denied(path):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(os, "listdir", denied)
    with pytest.raises(InputError, match=f"{tmp_path}: wanted a readable folder, got Permission denied"):
        list_boards(tmp_path, None)


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="needs links")
def test_a_link_out_of_the_folder_is_no_card_of_it(tmp_path):
    """Whoever packed the folder could have any file read; a link within it is a card like any other."""
    folder = write_cards(tmp_path / "tops", "a", bad=False)
    (tmp_path / "b.toml").write_text(card_text("b"))
    (folder / "inner").mkdir()
    (folder / "inner" / "c.toml").write_text(card_text("c"))
    (folder / "b.toml").symlink_to(tmp_path / "b.toml")
    (folder / "c.toml").symlink_to(folder / "inner" / "c.toml")
    (folder / "d.toml").symlink_to(folder / "d.toml")  # to itself
    (folder / "E.TOML").write_text(card_text("E"))
    read = {}
    for board in list_boards(folder, None)[0]:
        try:
            read[board.name] = board.card().name
        except InputError as error:
            read[board.name] = str(error)

    assert (read["a"], read["c"], read["E"]) == ("a", "c", "E")
    assert read["b"] == (
        "b.toml: wanted a card in the folder of the batch, got a link that leads out of it (copy the card)"
    )
    assert "d.toml" in read["d"]


def test_one_board_has_the_prior_of_its_symmetry():
    """The prior of E alone for an isotropic board, and never for another one."""
    text = card_text("b", 1.01).replace('published_coefficients = "paper-clamped"\n', "")
    board = Board.from_text(text, "b")
    metals = PriorCard.from_quantities("metals", {"E": Quantity.from_median(70e9, 2.0)}, source="a test")
    with pytest.raises(InputError, match="wanted a prior of three constants, got metals, which states E alone"):
        bayesplate.fit_board(board, metals)


def test_one_board_is_a_pure_function_that_travels(two, one):
    row = rows_of(two.table.read_bytes())["b"]
    board, prior = Board.from_text(card_text("b", 1.01), "b"), load_prior("weakly-informative")
    with pytest.raises(InputError, match="request tables clamped: wanted the published coefficients"):
        bayesplate.fit_board(board, prior)
    request = bayesplate.FitRequest(seed=int(row["seed"]), tables=load_named_cards(board).tables)

    found = bayesplate.fit_board(*pickle.loads(pickle.dumps((board, prior, request))))

    assert pickle.loads(pickle.dumps(found)) == found
    assert float(row["E_x_mean"]) == found.elastic.E_x.mean
    assert float(row["density_mean"]) == found.derived["density"].mean
    assert row["card_sha256"] == found.card_sha256
    assert (one[1] / "boards" / "b" / "summary.json").read_text(encoding="utf-8") == json_text(found)
    assert set(files_in(one[1] / "boards" / "b")) == {"summary.json", "posterior.nc"}


def test_the_same_bytes_for_one_worker_and_two_and_a_bad_card_stops_nothing(two, one):
    run, out = one

    assert run.exit_code == 7, run.output
    assert "2 of 4 boards were not fitted" in run.stderr
    assert "n: refused: n.toml [plate] thickness_mm: wanted a positive number, got -3" in run.stderr
    assert run.stderr.rstrip().endswith(WHY)
    assert "own-prior.toml is a card of another kind" in run.stdout
    for name in ("boards.csv", "boards.jsonl", "batch.json", "grading.csv"):
        assert (out / name).read_bytes() == (two.folder / name).read_bytes()
    rows = rows_of(two.table.read_bytes())
    outcomes = {"a": "fitted", "b": "fitted", "m": "refused", "n": "refused"}
    assert {name: row["outcome"] for name, row in rows.items()} == outcomes
    assert "m.toml line 1" in rows["m"]["message"]
    assert rows["n"]["E_x_mean"] == ""
    assert "2 of 4 boards were fitted" in (two.folder / "grading.html").read_text(encoding="utf-8")
    with pytest.raises(BatchError, match="2 of 4"):
        two.require_all()


@pytest.fixture
def answered(monkeypatch):
    """Boards answered in this process, by a function of a call; returns the names of those that were asked for."""

    def by(answer):
        names = []

        def computed_here(free, calls):
            for key, (function, arguments) in calls:
                future: Future[Any] = Future()
                names.append(arguments[0].name)
                try:
                    future.set_result(answer(function, arguments))
                except InputError as error:
                    future.set_exception(error)
                yield key, future

        monkeypatch.setattr("bayesplate.commands.batch_run.compute_calls", computed_here)
        return names

    return by


def as_fitted(function, arguments):
    """The answer of a fit that was none."""
    return replace(SUMMARY, name=(name := arguments[0].name), doubts=("misread?",) * (name == "c"))


def test_a_board_has_its_seed_from_its_card_and_only_changed_cards_are_fitted_again(cards, two, tmp_path, answered):
    out, again = shutil.copytree(two.folder, tmp_path / "out"), shutil.copytree(cards, tmp_path / "cards")
    (again / "a.toml").unlink()
    (again / "m.toml").write_text(card_text("m", 1.02), encoding="utf-8")
    submitted = answered(as_fitted)

    result = bayesplate.batch(again, out, workers=1, resume=True, report=False)

    before, after = rows_of(two.table.read_bytes()), rows_of(result.table.read_bytes())
    assert submitted == ["m"]
    assert set(after) == {"b", "m", "n"}
    assert {name: after[name] for name in "bn"} == {name: before[name] for name in "bn"}
    assert after["m"]["outcome"] == "fitted"
    assert len({row["seed"] for row in after.values() if row["seed"]}) == 2
    assert (out / "boards.jsonl").read_bytes().count(b"\n") == 3


def processes_of(session: int) -> list[int]:
    """Processes of a session that are alive."""
    found = []
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[3]) == session and fields[0] != "Z":
                found.append(int(folder.name))
    return found


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_killed_at_a_random_moment_and_resumed_the_table_is_the_same(cards, two, tmp_path):
    """Killed with a board or two in the journal and the next line half written; its workers end with it."""
    out = tmp_path / "out"
    command = [sys.executable, "-m", "bayesplate", "batch", str(cards), "--workers", "2", "--out", str(out)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    run = subprocess.Popen([*command, "--no-report"], env=environment, start_new_session=True,
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # fmt: skip
    journal, n_lines = out / "boards.jsonl", int(np.random.default_rng(1).integers(1, 4))
    until = time.monotonic() + 120
    while time.monotonic() < until and run.poll() is None:
        if journal.exists() and journal.read_bytes().count(b"\n") >= n_lines:
            break
        time.sleep(0.01)
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    with journal.open("ab") as stream:
        stream.write(b'{"key": "half a li')
    until = time.monotonic() + 20
    while processes_of(run.pid) and time.monotonic() < until:
        time.sleep(0.05)

    assert processes_of(run.pid) == []
    assert not (out / "boards.csv").exists()
    result = bayesplate.batch(cards, out, workers=2, resume=True, report=False)
    assert result.table.read_bytes() == two.table.read_bytes()
    assert (out / "boards.jsonl").read_bytes() == (two.folder / "boards.jsonl").read_bytes()


@pytest.mark.slow
def test_a_cluster_of_two_processes_gives_the_same_bytes(cards, two, tmp_path):
    import warnings

    import distributed

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the cluster's own libraries
        with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster:
            result = bayesplate.batch(cards, tmp_path / "out", dask=cluster.scheduler_address, report=False)

    assert result.table.read_bytes() == two.table.read_bytes()


SCRIPT = """
import os
from bayesplate.commands.workers import compute_calls, worker_processes
calls = [(0, (abs, (-1,))), (1, (os._exit, (1,))), (2, (abs, (-3,))), (3, (int, ("x",)))]
with worker_processes(2) as free:
    found = dict(compute_calls(free, iter(calls)))
print(found[0].result(), repr(found[1].exception()), found[2].result(), repr(found[3].exception()))
"""


def test_a_worker_that_dies_takes_no_other_board_with_it_and_none_runs_the_script_that_started_it(tmp_path):
    """Without a guard the script would begin the batch again in each."""
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    program = [sys.executable, "script.py"]
    source = {"cwd": tmp_path, "env": {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}}
    done = subprocess.run(program, capture_output=True, text=True, check=False, **source)

    assert done.stderr == ""
    (said,) = done.stdout.splitlines()
    died, failed = "WorkerDied('the worker ended without an answer: killed", "ValueError("
    assert [said.startswith(f"1 {died}"), f" 3 {failed}" in said] == [True, True]


INTERRUPTED = """
import os, signal, threading
from bayesplate.commands.workers import compute_calls, worker_processes
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    with worker_processes(1) as free:
        threading.Timer(0.2, os.killpg, (0, signal.SIGINT)).start()
        list(compute_calls(free, iter([(0, (abs, (-1,)))])))
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs a group of processes")
def test_an_interruption_while_workers_start_ends_all_without_a_word(tmp_path):
    """The terminal sends it to all of them, also to one that is still importing."""
    program = [sys.executable, "-c", INTERRUPTED]
    source = {"cwd": tmp_path, "env": {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}}
    done = subprocess.run(program, capture_output=True, text=True, check=False, start_new_session=True, **source)

    assert (done.stdout, done.stderr, done.returncode) == ("interrupted\n", "", 0)


TABLE = """name,thickness_mm,mass_g,mass_g sd,"(0,0)","(0,1)","(1,0)","(1,1)","clamped (0,2)"
top-1,3.1,300,2,57,100,130,162,170
top-2,2.9;3.0;3.1,,,57,100,130,162,
"=cmd()",3,300,,57,100,130,162,170
../../evil,3,300,,57,100,130,162,170
twice,3,300,,57,100,130,162,170
Twice,3,300,,58,100,130,162,170
top-3,thick,300,,57,100,130,162,170
"""


@pytest.fixture
def table(tmp_path) -> Path:
    """A table of boards, most of them with faults, and its template."""
    (tmp_path / "template.toml").write_text(TEMPLATE, encoding="utf-8")
    (tmp_path / "tops.csv").write_text(TABLE, encoding="utf-8")
    return tmp_path / "tops.csv"


def test_a_row_is_the_card_that_the_template_and_its_cells_make(table):
    boards, _ = list_boards(table, table.parent / "template.toml")
    one, two = (board.card() for board in boards if board.name in ("top-1", "top-2"))

    assert (one.inputs["mass"].mean, one.inputs["mass"].sd) == (0.3, 0.002)
    assert "density" not in one.inputs
    assert one.inputs["thickness"].mean == pytest.approx(3.1e-3)
    assert [str(label) for label in one.setups[0].labels] == ["(0,0)", "(0,1)", "(1,0)", "(1,1)", "(0,2)"]
    assert two.inputs["thickness"].readings == pytest.approx((2.9e-3, 3.0e-3, 3.1e-3))
    assert two.inputs["density"].mean == 399.0
    assert len(two.setups[0].labels) == 4


def test_a_board_is_complete_with_the_files_that_are_asked_for(tmp_path):
    """Its folder, and its page only where there are pages, to which the batch's own page leads."""
    row = BoardRow("top", "fitted")
    (folder := tmp_path / "boards" / "top").mkdir(parents=True)
    for files, expected in (
        ((), (True, False, False)),
        (("summary.json",), (True, True, False)),
        (("report.html",), (True, True, True)),
    ):
        for file in files:
            (folder / file).touch()
        kept = [BatchRun([], None, tmp_path, *asked, None)._is_complete(row)
                for asked in ((False, True), (True, False), (True, True))]  # fmt: skip
        assert tuple(kept) == expected, files


def test_two_boards_of_one_name_have_two_rows_and_one_line_whether_begun_or_gone_on_with(table, tmp_path):
    header, row = TABLE.splitlines()[0], next(line for line in TABLE.splitlines() if line.startswith("twice,"))
    (tmp_path / "tops.csv").write_text("\n".join([header, row, row]) + "\n")
    folder, template = tmp_path / "out", tmp_path / "template.toml"
    found = []
    for resume in (False, True):
        result = bayesplate.batch(table, folder, template=template, resume=resume, report=False)
        found.append((result.table.read_bytes(), (folder / "boards.jsonl").read_bytes()))
        assert not (folder / "grading.html").exists()
        (folder / "grading.html").write_text("of another grading")

    assert found[0] == found[1]
    assert (found[0][0].count(b"more than once"), found[0][1].count(b"\n")) == (2, 1)


def test_a_table_in_parquet_says_the_same(table, tmp_path):
    import pyarrow
    from pyarrow import parquet

    (tmp_path / "tops.csv").write_text(TABLE.replace("top-1", "1").replace("top-2", "007"))
    rows = list(csv.DictReader(io.StringIO((tmp_path / "tops.csv").read_text())))[:2]
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    hertz = {name: [float(one) if one else None for one in columns[name]] for name in columns if "(" in name}
    parquet.write_table(pyarrow.table(columns | hertz), tmp_path / "tops.parquet")
    texts = []
    for file in ("tops.csv", "tops.parquet"):
        boards, _ = list_boards(tmp_path / file, tmp_path / "template.toml")
        texts.append([board.card().text for board in boards if board.name in ("1", "007")])

    assert texts[0] == texts[1]
    assert len(texts[0]) == 2


def test_names_of_boards_leave_no_folder_and_are_cells_that_no_sheet_executes(table, tmp_path, answered):
    asked = answered(as_fitted)
    (tmp_path / "tops.csv").write_text("\n".join(TABLE.splitlines()[:1] + TABLE.splitlines()[3:]))
    result = bayesplate.batch(table, tmp_path / "deep" / "out", template=tmp_path / "template.toml", folders=True)

    rows = rows_of(result.table.read_bytes())
    assert asked == []
    assert {row["outcome"] for row in rows.values()} == {"refused"}
    assert set(rows) == {"'=cmd()", "../../evil", "twice", "Twice", "top-3"}
    assert {path.name for path in (tmp_path / "deep").iterdir()} == {"out"}
    assert not (result.folder / "boards").exists()


def test_faults_of_rows_name_the_table_and_the_row_as_it_is_counted_there(table, tmp_path, answered):
    """Lines without a word count but are no boards; so a fault of sizes, of a card that a row names, and of a name."""
    answered(lambda function, arguments: function(*arguments))
    header = 'name,thickness_mm,density_kg_m3,prior,"(0,0)","(0,1)","(1,0)",,'
    rows = [",,,,", header, "", "thick,3 mm,400,,57,100,130,,", ",,,,,,,,", "light,3,2,,57,100,130,,"]
    rows += ["prior,3,400,x.toml,57,100,130", "twice,3,400,,57,100,130", "", "Twice,3,400,,58,100,131"]
    table.write_text("\n".join(["", *rows]))
    result = bayesplate.batch(table, tmp_path / "out", template=tmp_path / "template.toml", report=False)
    told = {one.name: one.message for one in result.summary.failed}

    assert told["thick"].startswith("tops.csv row 2 -> thick.toml [plate] thickness_mm: wanted a number")
    assert set(told) == {"thick", "light", "prior", "twice", "Twice"}
    assert told["light"].startswith("tops.csv row 4 -> light.toml [plate] density_kg_m3: wanted a density")
    assert told["prior"].startswith("tops.csv row 5 -> prior.toml [material] prior -> ")
    twice = "wanted a name of its own, got twice more than once (a and A are one name)"
    assert told["twice"] == f"tops.csv row 6 -> {twice}"
    assert told["Twice"].startswith("tops.csv row 8 -> ")


def test_doubts_of_a_fit_and_of_copied_rows_reach_the_table_and_the_summary_and_not_the_journal(table, answered):
    """A copy that is taken out leaves no doubt behind when the run is continued."""
    answered(as_fitted)
    header, *rows = 'name,"(0,0)","(0,1)","(1,0)"', "a,57,100,130", "b,57,100,130", "c,58,100,130"
    found = []
    for some, resume in ((rows, False), (rows[1:], True)):
        table.write_text("\n".join([header, *some]))
        template = table.parent / "template.toml"
        result = bayesplate.batch(table, table.parent / "out", template=template, report=False, resume=resume)
        doubts = {one.name: one.doubt for one in result.summary.doubts}
        in_table = {name: row["doubt"] for name, row in rows_of(result.table.read_bytes()).items()}
        assert {name: doubt for name, doubt in in_table.items() if doubt} == doubts
        found.append(doubts)

    copied = "every reading is that of {} to the last digit: one board twice, or a copy?"
    assert found == [{"a": copied.format("b"), "b": copied.format("a"), "c": "misread?"}, {"c": "misread?"}]


def test_a_folder_keeps_what_stands_behind_a_point_in_its_name(table):
    (table.parent / "2024.01").mkdir()
    assert default_batch_folder(table.parent / "2024.01") == Path("results/2024.01")
    assert default_batch_folder(table) == Path("results/tops")


def test_a_table_whose_columns_are_no_keys_is_refused(table, tmp_path):
    table.write_text("thicknes_mm\n3\n", encoding="utf-8")
    with pytest.raises(InputError) as refused:
        bayesplate.batch(table, tmp_path / "out", template=tmp_path / "template.toml")

    assert "column 1: wanted a key of a board card, or the label of a mode" in str(refused.value)
    assert 'wanted a column with the names of the boards, got none (call it "name")' in str(refused.value)
    assert not (tmp_path / "out").exists()
