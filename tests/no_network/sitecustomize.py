"""A Python that has no network: it loads this file at its start, and so do the processes that it starts.

Python tells a hook of each connection and each look-up of a host before it is made, whichever library asks for it and
under whatever name. Sockets that are files, by which processes of one machine talk to each other, are let through.
"""

from __future__ import annotations

import sys
from typing import Any

_A_FILE = 1
"""The family of sockets that are files; the module socket has the name, and this file loads no other."""
EVENTS = {
    "socket.connect",
    "socket.bind",
    "socket.sendto",
    "socket.sendmsg",
    "socket.getaddrinfo",
    "socket.gethostbyname",
    "socket.gethostbyaddr",
    "socket.getnameinfo",
    "urllib.Request",
    "http.client.connect",
}


def forbid(event: str, arguments: tuple[Any, ...]) -> None:
    """Raise where the network is asked for."""
    if event in EVENTS:
        if getattr(arguments[0], "family", None) == _A_FILE:
            return
        raise AssertionError(f"the network was asked for: {event}")


if __name__ == "sitecustomize":
    sys.addaudithook(forbid)
