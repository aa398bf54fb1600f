"""Look up the locked versions among the known weaknesses of packages, in an environment of its own below build/.

    python .ci/audit.py

Exit code 0: none is known, or there is no network and nothing was looked up, which is said; 1: some are known, or the
audit itself failed.
"""

from __future__ import annotations

import json
import subprocess
import sys
import venv
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
LOCK = ROOT / "requirements.lock"
PLACE = ROOT / "build" / "audit"
UNREACHED = ("connection broken", "ConnectionError", "Could not connect", "Failed to establish", "name resolution")
"""What pip and pip-audit say where nothing answers."""
NOTHING = "there is no network, or nothing that knows weaknesses answers: nothing was audited"


def main() -> int:
    """Install pip-audit, run it, and say what it found."""
    binaries = PLACE / ("Scripts" if sys.platform == "win32" else "bin")
    if not list(binaries.glob("pip-audit*")):
        venv.create(PLACE, with_pip=True, clear=True)
        made = _run(str(binaries / "python"), "-m", "pip", "install", "--quiet", "pip-audit")
        if made.returncode:
            return _failed(made)
    options = ("--no-deps", "--disable-pip", "--progress-spinner", "off", "--format", "json")
    done = _run(str(binaries / "pip-audit"), "--requirement", str(LOCK), *options)
    try:
        found = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError):
        return _failed(done)
    lines, code = told(found)
    print("\n".join(lines))
    return code


def told(found: list[dict[str, Any]]) -> tuple[list[str], int]:
    """What to say of the packages that were looked up, and the exit code."""
    skipped = [one["name"] for one in found if "skip_reason" in one]
    weak = [one for one in found if one.get("vulns")]
    if len(skipped) == len(found):
        return [NOTHING], 0
    lines = [
        f"{one['name']} {one['version']}: {vuln['id']}, mended in {', '.join(vuln['fix_versions']) or 'no version yet'}"
        for one in weak
        for vuln in one["vulns"]
    ]
    lines.append(
        f"{len(found) - len(skipped)} of {len(found)} packages were looked up, {len(weak)} have known weaknesses"
    )
    if skipped:
        lines.append(f"not looked up: {', '.join(skipped)}")
    return lines, 1 if weak else 0


def _run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(arguments, capture_output=True, text=True, check=False)


def _failed(done: subprocess.CompletedProcess[str]) -> int:
    """No network is no fault of the versions; everything else is shown."""
    if any(words in done.stderr for words in UNREACHED):
        print(NOTHING)
        return 0
    print(done.stdout + done.stderr, file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
