"""How an ideal plate rings; called, `bayesplate.modes(card)` is the command of that name, `workflow/modes.py`.

The folder of plate solutions and the command share a name, and Python has one attribute for both: who imports a file
of the folder puts the folder there. So the folder itself can be called, and is the same thing before and after.
"""

from __future__ import annotations

import sys
from inspect import Signature, signature
from types import ModuleType
from typing import Any


class _CommandModes(ModuleType):
    """The folder, which hands a call on to the command."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """The lowest modes of a board; see `bayesplate.workflow.modes.modes`."""
        from bayesplate.workflow.modes import modes

        return modes(*arguments, **options)

    @property
    def __signature__(self) -> Signature:
        """That of the command, for `help` and for editors."""
        from bayesplate.workflow.modes import modes

        return signature(modes)


sys.modules[__name__].__class__ = _CommandModes
