"""How long a warm-up is: until the walkers have arrived, and again while what it taught serves badly.

What walkers propose is learnt from the end of the warm-up and stays. Learnt from walkers on their way, or before a
narrow peak of the posterior had been found, it would never fit: so the first warm-up lasts until the log density no
longer rises, and where the draws after it turn out to depend on each other over many steps, they become a further
warm-up, from which the proposals are learnt anew. Nothing of a warm-up is kept, and it depends on the chunks alone, so
that a run that is resumed has the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.posterior.checkpoint import Chunk
from bayesplate.posterior.convergence import autocorrelation_time

FEWEST, MOST = 6, 40
"""Chunks of the first warm-up."""
TAUGHT = 3
"""Chunks at its end that teach what is proposed."""
_RISE = 1.0
"""Of the mean log density within two chunks, from which on walkers are still on their way to the posterior.

Where they are, it scatters by the square root of half the number of parameters over that of the walkers.
"""
_AGAIN = 16
"""Chunks after which draws are judged for the first time; each next time after twice as many."""
_FEWEST_TAUS = 20.0
"""Autocorrelation times that draws have to hold when they are judged, or proposals are learnt anew from them.

Two fifths of what a run must have in the end: most of the way is to go still, and better proposals make up for it.
"""


@dataclass
class WarmUp:
    """What of a run is warm-up, as far as its chunks tell.

    Attributes
    ----------
    first : int or None
        Chunks of the first warm-up; None before it is over.
    end : int
        Chunks that are dropped.
    """

    first: int | None = None
    end: int = 0
    _followed: int = 0
    _taught: int = 0
    _trial: int = 0
    _interval: int = _AGAIN

    def follow(self, chunks: Sequence[Chunk]) -> bool:
        """Take note of the chunks that have come, in order; whether something new is to be learnt.

        Parameters
        ----------
        chunks : sequence of Chunk
            All of the run.
        """
        before = self.end
        for n in range(self._followed + 1, len(chunks) + 1):
            self._followed = n
            if self.first is None:
                if n >= FEWEST and (n == MOST or _rise(chunks[n - TAUGHT : n]) < _RISE):
                    self.first, self.end, self._taught, self._trial = n, n, n - TAUGHT, n
            elif n == self._trial + self._interval:
                if _length_in_taus(chunks[self.end : n]) < _FEWEST_TAUS:
                    self._taught, self.end = self.end, n
                self._trial, self._interval = n, 2 * self._interval
        return self.end > before

    def lesson(self, chunks: Sequence[Chunk]) -> Sequence[Chunk]:
        """Those chunks of a finished warm-up that teach what is proposed."""
        return chunks[self._taught : self.end]


def _rise(chunks: Sequence[Chunk]) -> float:
    """Of the mean log density from the first to the last of some chunks."""
    return float(chunks[-1].log_prob.mean() - chunks[0].log_prob.mean())


def _length_in_taus(chunks: Sequence[Chunk]) -> float:
    """Length in autocorrelation times of the slowest parameter, averaged over ensembles."""
    draws = np.concatenate([chunk.draws for chunk in chunks], axis=1)
    return draws.shape[1] / float(np.max(np.mean([autocorrelation_time(each) for each in draws], axis=0)))
