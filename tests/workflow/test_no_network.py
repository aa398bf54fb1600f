"""Every command runs where there is no network, and writes into its output folder alone."""

from __future__ import annotations

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
PROGRAM = """
import sys
from killed_runs import quickly
from bayesplate.cli import main
quickly()
main(sys.argv[1:])
"""


def without_network(program: str, *arguments: str, desk: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a program in a Python that has no network, from a folder."""
    paths = (str(TESTS / "no_network"), str(TESTS), str(TESTS.parent))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OMP_NUM_THREADS": "1"}
    run = [sys.executable, "-c", program, *arguments]
    return subprocess.run(run, env=environment, cwd=desk, capture_output=True, text=True, check=False)


def test_every_command_is_tried():
    assert set(COMMANDS) == set(main.commands)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_runs_without_a_network(command, tmp_path):
    """With all that it writes, pages, figures, tables; and nothing of it lies anywhere but in the output folder."""
    force, heard = hits(np.random.default_rng(2), [0.05], (0.02, 0.02))
    places = {
        "OUT": str(tmp_path / "out"),
        "HIT": str(write_wav(tmp_path / "hit.wav", 4000.0, force, heard)),
        "CARD": str(TESTS.parent / "docs" / "cards" / "half-top-unmeasured.toml"),
        "CARDS": str(write_cards(tmp_path / "cards", "a", bad=False)),
    }
    given = [places.get(word, word.replace("OUT/", f"{tmp_path}/")) for word in COMMANDS[command]]

    (tmp_path / "desk").mkdir()
    before = {path for path in tmp_path.rglob("*") if "out" not in path.relative_to(tmp_path).parts}

    done = without_network(PROGRAM, command, *given, "--debug", desk=tmp_path / "desk")

    assert done.returncode == 0, done.stderr
    assert "network" not in done.stderr
    written = set(tmp_path.rglob("*")) - before
    outside = {path.relative_to(tmp_path).as_posix() for path in written if not path.is_relative_to(tmp_path / "out")}
    assert outside == ({"my-board.toml"} if command == "new" else set())


ASKING = {
    "a connection": "import socket; socket.create_connection(('127.0.0.1', 9))",
    "a look-up": "from socket import getaddrinfo; getaddrinfo('localhost', 80)",
    "a page": "from urllib.request import urlopen; urlopen('http://localhost/')",
    "a datagram": "import socket; socket.socket(type=socket.SOCK_DGRAM).sendto(b'', ('127.0.0.1', 9))",
    "another process": "import subprocess, sys; sys.exit(subprocess.run([sys.executable, '-c', "
    "'import socket; socket.create_connection((\"127.0.0.1\", 9))']).returncode)",
}


@pytest.mark.parametrize("asked", ASKING)
def test_who_asks_for_the_network_is_noticed(asked):
    """The negative control."""
    done = without_network(ASKING[asked])

    assert done.returncode == 1
    assert "the network was asked for" in done.stderr


def test_a_command_that_asked_for_it_would_fail(tmp_path):
    """The negative control of the commands themselves: one line more in the package is enough."""
    line = "import bayesplate.workflow.check as home, socket\nwhole = home.check\n"
    line += "home.check = lambda *a, **k: (socket.getaddrinfo('localhost', 80), whole(*a, **k))[1]\n"
    done = without_network(line + PROGRAM, "check", BOARD, "--debug")

    assert done.returncode == 70
    assert "the network was asked for: socket.getaddrinfo" in done.stderr
