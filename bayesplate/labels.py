"""The label (m,n) of a mode: how many nodal lines its shape crosses along x and along y."""

from __future__ import annotations

import re
from typing import NamedTuple

from bayesplate.errors import Fault, InputError

HIGHEST_ORDER = 9
"""Nodal lines one way that the production mesh resolves: within 6 cents where the plate bends alike both ways, within
12 where the wavelengths along its sides differ by up to 1.4."""

HIGHEST_FIRST_LABEL = 2
"""Largest number of a laboratory's first label: where two held edges are counted as nodal lines, labels begin there."""

HIGHEST_INDEX = HIGHEST_ORDER + HIGHEST_FIRST_LABEL
_LABEL_PATTERN = re.compile(r"[ \t]*\([ \t]*(0|[1-9][0-9]?)[ \t]*,[ \t]*(0|[1-9][0-9]?)[ \t]*\)[ \t]*")


class Label(NamedTuple):
    """Name of a mode.

    Attributes
    ----------
    m : int
        Interior nodal lines crossed along x, plus the laboratory's first label.
    n : int
        The same along y.
    """

    m: int
    n: int

    def __str__(self) -> str:
        return f"({self.m},{self.n})"

    @classmethod
    def parse(cls, text: str) -> Label:
        """Read a label such as "(1,0)"; spaces beside the numbers are ignored.

        Parameters
        ----------
        text : str
            Two whole numbers from 0 to 11 in round brackets, parted by a comma.

        Returns
        -------
        Label

        Raises
        ------
        InputError
            If the text is anything else: "10", "(1;0)", "(1.0,0)", "(-1,0)".
        """
        match = _LABEL_PATTERN.fullmatch(text) if isinstance(text, str) else None
        label = cls(int(match[1]), int(match[2])) if match else None
        if label is None or max(label) > HIGHEST_INDEX:
            wanted = f'two whole numbers from 0 to {HIGHEST_INDEX}, written like "(1,0)"'
            got = ascii(text[:40] + "..." if isinstance(text, str) and len(text) > 40 else text)
            raise InputError(Fault("mode label", wanted, f'"{got[1:-1]}"' if isinstance(text, str) else got))
        return label
