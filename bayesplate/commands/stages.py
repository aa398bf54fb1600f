"""The progress of a run of several parts: which part is at work, and the share of the whole that is done."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from bayesplate.posterior.sampling import Progress

Tell = Callable[[Progress], None]


@dataclass
class Stages:
    """Tells of every part of a run as a share of the whole; the share never falls.

    Attributes
    ----------
    tell : callable or None
        Told; None tells nobody.
    left : float
        How long the parts that are still to come take, begun ones not counted, in any unit of time.
    """

    tell: Tell | None
    left: float
    _stage: str = ""
    _past: float = 0.0
    _length: float = 0.0
    _done: float = 0.0

    def begin(self, stage: str, length: float) -> None:
        """Begin the next part, which takes so long beside the others."""
        self._past += self._length
        self._stage, self._length = stage, length
        self.left = max(self.left - length, 0.0)
        self.reached(0.0)

    def sampled(self, progress: Progress) -> None:
        """Tell of sampling within the part."""
        self.reached(progress.sampled, progress)

    def reached(self, share: float, progress: Progress | None = None) -> None:
        """Tell that a share of the part is done."""
        whole = self._past + self._length + self.left
        self._done = max(self._done, (self._past + share * self._length) / whole)
        if self.tell is not None:
            self.tell(replace(progress or Progress(0, 0), stage=self._stage, done=self._done))
