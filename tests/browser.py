"""A headless browser for tests, driven through its debugging pipe: nothing but the standard library and a browser."""

from __future__ import annotations

import json
import os
import re
import select
import shutil
import subprocess
import time
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
_ARGUMENTS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--no-default-browser-check",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--metrics-recording-only",
    "--remote-debugging-pipe",
)
_PATIENCE = 60.0


def browser_path() -> str | None:
    """A browser of this machine; None if there is none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Page:
    """One open page.

    Attributes
    ----------
    complaints : list of str
        What stood in the console or in the log.
    requests : list of str
        Every address that was asked for.
    """

    def __init__(self, browser: Browser, session: str) -> None:
        self.browser, self.session = browser, session
        self.complaints: list[str] = []
        self.requests: list[str] = []

    def ask(self, method: str, **arguments: Any) -> dict[str, Any]:
        """One command, and its answer."""
        return self.browser.ask(method, self.session, **arguments)

    def open(self, address: str, width: int, height: int = 900) -> None:
        """Go to an address in a window of some size, and wait until everything is loaded."""
        self.ask(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 500
        )
        self.complaints.clear()
        self.requests.clear()
        self.browser.loaded.discard(self.session)
        self.ask("Page.navigate", url=address)
        self.browser.wait_for(lambda: self.session in self.browser.loaded)

    def value(self, expression: str) -> Any:
        """What an expression comes to in the page."""
        answer = self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise AssertionError(answer["exceptionDetails"])
        return answer["result"].get("value")

    def prefer(self, scheme: str) -> None:
        """Let the reader prefer a light or a dark page."""
        self.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def printed(self, width: float, height: float) -> int:
        """On how many sheets of paper the page comes out; inches."""
        answer = self.ask("Page.printToPDF", paperWidth=width, paperHeight=height, preferCSSPageSize=False)
        return len(re.findall(rb"/Type\s*/Page\b(?!s)", b64decode(answer["data"])))


class Browser:
    """A running browser: commands go in and events come out as JSON, each ended by a zero byte."""

    def __init__(self, into: int, out_of: int) -> None:
        self._into, self._out_of = into, out_of
        self._rest = b""
        self._count = 0
        self._answers: dict[int, dict[str, Any]] = {}
        self.loaded: set[str] = set()
        self.pages: dict[str, Page] = {}

    def ask(self, method: str, session: str | None = None, **arguments: Any) -> dict[str, Any]:
        """Send a command and wait for its answer."""
        self._count += 1
        number = self._count
        message: dict[str, Any] = {"id": number, "method": method, "params": arguments}
        if session is not None:
            message["sessionId"] = session
        os.write(self._into, json.dumps(message).encode() + b"\0")
        self.wait_for(lambda: number in self._answers)
        answer = self._answers.pop(number)
        if "error" in answer:
            raise AssertionError(f"{method}: {answer['error']}")
        return answer["result"]

    def new_page(self) -> Page:
        """An empty page whose console, log and network are watched."""
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = self.pages[session] = Page(self, session)
        for domain in ("Page", "Runtime", "Log", "Network"):
            page.ask(f"{domain}.enable")
        return page

    def wait_for(self, is_done: Any) -> None:
        """Read what the browser says until something holds."""
        deadline = time.monotonic() + _PATIENCE
        while not is_done():
            ready, _, _ = select.select([self._out_of], [], [], max(0.0, deadline - time.monotonic()))
            data = os.read(self._out_of, 1 << 20) if ready else b""
            if not data:
                raise AssertionError("the browser does not answer")
            *messages, self._rest = (self._rest + data).split(b"\0")
            for message in messages:
                self._hear(json.loads(message))

    def _hear(self, message: dict[str, Any]) -> None:
        if "id" in message:
            self._answers[message["id"]] = message
            return
        page = self.pages.get(message.get("sessionId", ""))
        if page is None:
            return
        told = message["params"]
        if message["method"] == "Page.loadEventFired":
            self.loaded.add(page.session)
        elif message["method"] == "Network.requestWillBeSent":
            page.requests.append(told["request"]["url"])
        elif message["method"] == "Runtime.consoleAPICalled":
            page.complaints.append(f"{told['type']}: {told['args']}")
        elif message["method"] == "Runtime.exceptionThrown":
            page.complaints.append(str(told["exceptionDetails"]))
        elif message["method"] == "Log.entryAdded":
            page.complaints.append(f"{told['entry']['level']}: {told['entry']['text']}")


@contextmanager
def running_browser(path: str, profile: Path) -> Iterator[Browser]:
    """Start a browser with a profile of its own; it is gone at the end."""
    theirs_in, into = os.pipe()
    out_of, theirs_out = os.pipe()
    # The browser reads commands from descriptor 3 and writes to 4; a shell puts them there.
    command = f'exec "$@" 3<&{theirs_in} 4>&{theirs_out}'
    process = subprocess.Popen(
        ["/bin/bash", "-c", command, "browser", path, *_ARGUMENTS, f"--user-data-dir={profile}", "about:blank"],
        pass_fds=(theirs_in, theirs_out),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(theirs_in)
    os.close(theirs_out)
    try:
        browser = Browser(into, out_of)
        browser.ask("Browser.getVersion")
        yield browser
    finally:
        os.close(into)
        os.close(out_of)
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
