"""The raw messages of the contract, under the names of the .proto files: `nappe.v1.CreateSessionRequest(...)`.

A value of an enum is a number: `nappe.v1.FIELD_POSITIONS`. Most programs never need them.
"""

from __future__ import annotations

from typing import Any

from nappe._wire._contract import ENUMS, MESSAGES

_VALUES = {value.name: value.number for enum in ENUMS.values() for value in enum.values}


def __getattr__(name: str) -> Any:
    if name in MESSAGES:
        return MESSAGES[name]
    if name in _VALUES:
        return _VALUES[name]
    raise AttributeError(f"the contract has no message and no value of an enum that is called {name!r}")


def __dir__() -> list[str]:
    return sorted([*MESSAGES, *_VALUES])
