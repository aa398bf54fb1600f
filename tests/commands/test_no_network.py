"""Every command runs where there is no network, and writes into its output folder alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from killed_runs import TRIED
from made_batches import write_cards
from made_recordings import hits, write_wav

from bayesplate.cli import main

BOARD = "fiemme-spruce-clamped"
TESTS = Path(__file__).parents[1]
COMMANDS = {
    "check": (BOARD,),
    "modes": (BOARD, "--out", "OUT"),
    "fit": (BOARD, "--out", "OUT"),
    "compare": (BOARD,),
    "diagnose": ("paper-cantilever-fe", "--out", "OUT"),
    "plan": (BOARD, "--out", "OUT", "--between", ",".join(TRIED)),
    "new": ("OUT/my-board.toml", "--length-x", "253", "--length-y", "114", "--thickness", "3", "--mass", "41",
            "--edges", "free"),
    "pick": ("HIT", "--out", "OUT", "--card", "CARD"),
    "cite": (BOARD,),
    "batch": ("CARDS", "--out", "OUT", "--workers", "1"),
}  # fmt: skip
QUICK = ("check", "modes", "fit", "new", "pick", "cite")
PROGRAM = """
import json, sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from killed_runs import quickly
from bayesplate.cli import main
quickly()
ended = {}
for command, *given in json.loads(sys.argv[1]):
    told = StringIO()
    try:
        with redirect_stdout(StringIO()), redirect_stderr(told):
            main([command, *given, "--debug"])
    except SystemExit as end:
        ended[command] = (end.code, told.getvalue())
print(json.dumps(ended))
"""


def without_network(program: str, *arguments: str, desk: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a program in a Python that has no network, from a folder."""
    paths = (str(TESTS / "no_network"), str(TESTS), str(TESTS.parent))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OMP_NUM_THREADS": "1"}
    run = [sys.executable, "-c", program, *arguments]
    return subprocess.run(run, env=environment, cwd=desk, capture_output=True, text=True, check=False)


def ended(commands, desk=None, program=PROGRAM):
    """Exit code and messages of commands that are run one after another without a network."""
    done = without_network(program, json.dumps(commands), desk=desk)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def left_by(some, tmp_path_factory):
    """Exit code, messages and files outside the output folder of some commands."""
    inputs, outputs, desk = (tmp_path_factory.mktemp(name) for name in ("inputs", "outputs", "desk"))
    force, heard = hits(np.random.default_rng(2), [0.05], (0.02, 0.02))
    places = {
        "HIT": str(write_wav(inputs / "hit.wav", 4000.0, force, heard)),
        "CARD": str(TESTS.parent / "docs" / "cards" / "half-top-unmeasured.toml"),
        "CARDS": str(write_cards(inputs / "cards", "a", bad=False)),
    }
    before = set(inputs.rglob("*"))
    commands = []
    for command in some:
        (outputs / command).mkdir()
        own = {**places, "OUT": str(outputs / command / "out")}
        commands.append(
            [command, *(own.get(word, word.replace("OUT/", f"{outputs / command}/")) for word in COMMANDS[command])]
        )
    done = ended(commands, desk)
    lost = [*desk.rglob("*"), *(set(inputs.rglob("*")) - before)]
    told = {}
    for command, (code, messages) in done.items():
        beside = [path for path in (outputs / command).iterdir() if path.name != "out"]
        told[command] = code, messages, {path.name for path in [*lost, *beside]}
    return told


def test_every_command_is_tried():
    assert set(COMMANDS) == set(main.commands)


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    return left_by(QUICK, tmp_path_factory)


@pytest.fixture(scope="module")
def slow(tmp_path_factory):
    return left_by([command for command in COMMANDS if command not in QUICK], tmp_path_factory)


SPEEDS = [("quick", c) if c in QUICK else pytest.param("slow", c, marks=pytest.mark.slow) for c in COMMANDS]


@pytest.mark.parametrize(("speed", "command"), SPEEDS)
def test_a_command_runs_without_a_network(speed, command, request):
    code, messages, outside = request.getfixturevalue(speed)[command]

    assert code == 0, messages
    assert "network" not in messages
    assert outside == ({"my-board.toml"} if command == "new" else set())


def test_a_process_that_asks_for_the_network_is_noticed():
    """The negative control, of a connection that another process asks for."""
    asking = "import socket; socket.create_connection(('127.0.0.1', 9))"
    done = without_network(f"import subprocess, sys; sys.exit(subprocess.call([sys.executable, '-c', {asking!r}]))")

    assert done.returncode == 1
    assert "the network was asked for" in done.stderr


def test_a_command_that_asked_for_it_would_fail():
    """The negative control of the commands themselves: one line more in the package is enough."""
    line = "import bayesplate.commands.check as home, functools, socket\nwhole = home.check\n"
    line += "asking = lambda *a, **k: (socket.getaddrinfo('localhost', 80), whole(*a, **k))[1]\n"
    line += "home.check = functools.wraps(whole)(asking)\n"
    code, messages = ended([["check", BOARD]], program=line + PROGRAM)["check"]

    assert code == 70
    assert "the network was asked for: socket.getaddrinfo" in messages
