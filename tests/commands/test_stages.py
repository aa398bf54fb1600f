"""The progress of a run of several parts: a share that only grows, and the time that is left."""

from __future__ import annotations

import pytest

from bayesplate.commands.fitting import Stages
from bayesplate.commands.printout import progress_text
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.sampling import Progress
from bayesplate.terminal import progress_line


def test_the_share_is_that_of_the_whole_and_never_falls():
    told = []
    stages = Stages(told.append, 8.0)
    stages.begin("one", 2.0)
    stages.sampled(Progress(100, 20_000, 0.5 * Gate().tau_count_min))
    stages.begin("two", 2.0)
    stages.remaining_time = 0.0  # nothing is left after this part, contrary to what was expected
    stages.reached(0.5)
    stages.remaining_time = 100.0
    stages.reached(1.0)
    assert [one.stage for one in told] == ["one", "one", "two", "two", "two"]
    assert [one.done for one in told] == pytest.approx([0.0, 1 / 8, 2 / 8, 3 / 4, 3 / 4])
    assert told[1].n_steps == 100


def test_the_line_tells_the_share_and_the_time_left_and_after_a_part_its_sampling():
    for done, seconds, words in (
        (0.0, 3.0, "0 % done: search"),
        (0.25, 10.0, "25 % done, about 30 s left: search"),
        (0.1, 60.0, "10 % done, about 9 min left: search"),
        (1.0, 60.0, "100 % done: search"),
    ):
        assert progress_text(Progress(0, 0, None, "search", done), seconds) == words
    text = progress_text(Progress(25, 20_000, None, "fit", 0.5), 10.0)
    assert text == "50 % done, about 10 s left: fit; sampling: step 25 of at most 20000"
    assert progress_text(Progress(25, 20_000)) == "sampling: step 25 of at most 20000"


def test_a_line_is_printed_when_a_part_begins_and_now_and_then_while_sampling(capsys):
    def sampling(n_steps: int) -> Progress:
        return Progress(n_steps, 20_000, None, "fit", 0.5)

    with progress_line(is_shown=True) as tell:
        for progress in (
            Progress(0, 0, None, "fit", 0.0),
            sampling(25),
            sampling(1000),
            Progress(0, 0, None, "search", 0.6),
        ):
            tell(progress)
    printed = capsys.readouterr().err.splitlines()
    assert [line.partition(" % done")[0] for line in printed] == ["0", "50", "60"]
    assert "step 1000" in printed[1]
