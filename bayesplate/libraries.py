"""ArviZ, which the package imports through this module alone."""

from __future__ import annotations

import os
import warnings
from importlib import import_module
from tempfile import TemporaryDirectory
from typing import Any


def load_arviz() -> Any:
    """Import ArviZ; 0.23 announces version 1 once a day and notes the day in a cache folder, which may be read-only."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)
        try:
            return import_module("arviz")
        except OSError:
            from unittest.mock import patch

            with TemporaryDirectory() as folder, patch.dict(os.environ, XDG_CACHE_HOME=folder):
                return import_module("arviz")
