"""Exceptions: a class for each kind that programs branch on, with the reason, and what to do.

Enters: how a call ended. Leaves: an exception.
"""

from __future__ import annotations

import errno
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from google.protobuf.message import DecodeError
from google.rpc import error_details_pb2, status_pb2

from nappe._wire._files import packed_bytes

_DETAILS = "grpc-status-details-bin"


@dataclass(frozen=True)
class Reason:
    """A reason for which a call can fail, as the table of the contract has it."""

    reason: str
    code: str
    is_divergence: bool
    meaning: str
    remedy: str


REASONS: Mapping[str, Reason] = {row["reason"]: Reason(**row) for row in json.loads(packed_bytes("reasons.json"))}
"""Every reason that a server of this version gives, by its name."""


class Error(Exception):
    """Something that nappe refused or could not do.

    `reason`: the server's reason, as listed in docs/errors.md; None where it was not the server that refused.
    `code`: the status code of gRPC in words, such as `NOT_FOUND`; None likewise.
    `metadata`: the values that the message names, as texts.
    `remedy`: what to do about it; None where nothing general can be said.
    """

    def __init__(
        self,
        message: str,
        *,
        reason: str | None = None,
        code: str | None = None,
        metadata: Mapping[str, str] | None = None,
        remedy: str | None = None,
    ) -> None:
        """An error with what is known of it."""
        super().__init__(message)
        self.reason = reason
        self.code = code
        self.metadata: dict[str, str] = dict(metadata or {})
        if remedy is None and reason is not None and reason in REASONS:
            remedy = REASONS[reason].remedy
        self.remedy = remedy

    @property
    def message(self) -> str:
        """What happened, without the reason."""
        return str(self.args[0])

    @property
    def is_transient(self) -> bool:
        """Whether the same call may succeed later: the server is away, draining or late."""
        return self.code in ("UNAVAILABLE", "DEADLINE_EXCEEDED")

    def __str__(self) -> str:
        """The message, the reason, and what to do."""
        told = self.message
        if self.reason is not None:
            told += f" ({self.reason})"
        return f"{told}\n{self.remedy}" if self.remedy else told

    def _number(self, name: str) -> int | None:
        text = self.metadata.get(name, "")
        return int(text) if re.fullmatch(r"-?[0-9]{1,18}", text) else None


class Unavailable(Error):
    """The server does not answer, or is shutting down."""


class NotFound(Error):
    """There is no session, scene, mesh or upload of this name, or it was deleted."""


class FileNotFound(NotFound, FileNotFoundError):
    """A file of this machine, a scene or a mesh, is not there. It is a `FileNotFoundError` too."""

    @property
    def errno(self) -> int:  # type: ignore[override]
        """The number of the system for it (ENOENT)."""
        return errno.ENOENT

    @property
    def filename(self) -> str | None:
        """The path that was looked for."""
        return self.metadata.get("path")


class Refused(Error):
    """The input is invalid. What it was meant to change did not change."""

    @property
    def line(self) -> int | None:
        """The line of the scene or of the mesh file, from 1, where told."""
        return self._number("line")

    @property
    def column(self) -> int | None:
        """The column within the line, from 1, where told."""
        return self._number("column")

    @property
    def field(self) -> str | None:
        """The argument, the field of the request or the key of the scene, where told."""
        return self.metadata.get("field")


class Diverged(Error):
    """A simulation went wrong: its session ended, and what it published before stays readable."""

    @property
    def step(self) -> int | None:
        """Index of the step that failed, from 0, where told."""
        return self._number("step")

    @property
    def particle(self) -> int | None:
        """The first particle concerned, over all particles, where one is known."""
        return self._number("particle")

    @property
    def cause(self) -> str:
        """What happened, in one sentence."""
        return self.message


class TooSlow(Error):
    """This program read frames more slowly than the session keeps them, or not at all for too long."""

    @property
    def oldest_frame(self) -> int | None:
        """The oldest frame that is kept, where told."""
        return self._number("oldest_frame")


class Expired(Error):
    """The frame that was asked for is no longer kept."""

    @property
    def oldest_frame(self) -> int | None:
        """The oldest frame that is kept, where told."""
        return self._number("oldest_frame")


class Full(Error):
    """A limit of the server is reached: of sessions, watchers, memory, sizes."""


class Unauthenticated(Error):
    """The server asks for a token, and was shown none or a wrong one."""


class Closed(Error):
    """This program closed the connection, before a call or a read or while it waited for its answer."""


_BY_REASON: dict[str, type[Error]] = {
    "FRAME_EXPIRED": Expired,
    "WATCHER_TOO_SLOW": TooSlow,
    "WATCHER_STALLED": TooSlow,
}
_BY_CODE: dict[str, type[Error]] = {
    "INVALID_ARGUMENT": Refused,
    "NOT_FOUND": NotFound,
    "RESOURCE_EXHAUSTED": Full,
    "UNAUTHENTICATED": Unauthenticated,
    "UNAVAILABLE": Unavailable,
}


def class_of(reason: str | None, code: str | None) -> type[Error]:
    """The class of an error."""
    if reason is not None and reason in REASONS and REASONS[reason].is_divergence:
        return Diverged
    return _BY_REASON.get(reason or "") or _BY_CODE.get(code or "") or Error


def from_call(call: Any, address: str, method: str, limit: float | None) -> Error:
    """The error of a call of gRPC that failed (a `grpc.RpcError`, which is the call too)."""
    details = next((value for key, value in call.trailing_metadata() or () if key == _DETAILS), None)
    return from_status(call.code().name, call.details() or "", details, address, method, limit)


def from_status(
    code: str, message: str, details: bytes | None, address: str, method: str, limit: float | None = None
) -> Error:
    """The error of a call of `method` that ended with a status: its code in words, its message, its packed details."""
    reason, metadata = _info(details)
    if reason is None and code == "UNAVAILABLE":
        never = "failed to connect" in message or "resolution" in message
        told = (
            f"no server answers at {address}: {message}" if never else f"the connection to {address} broke: {message}"
        )
        return Unavailable(
            told, code=code, remedy="Start one with `nappe serve`, or `nappe.serve()`; check the address."
        )
    if reason is None and code == "DEADLINE_EXCEEDED" and limit is not None:
        return Error(f"{address} did not answer {method} within {limit:g} s", code=code)
    if reason is None and code == "UNIMPLEMENTED":
        told = f"what answers at {address} is no server of nappe, or an older one: {message or method}"
        return Error(told, code=code)
    return class_of(reason, code)(message or code, reason=reason, code=code, metadata=metadata)


def _info(details: bytes | None) -> tuple[str | None, dict[str, str]]:
    """Reason and metadata in the packed details of a status."""
    if not details:
        return None, {}
    try:
        for detail in status_pb2.Status.FromString(details).details:
            info: Any = error_details_pb2.ErrorInfo()
            if detail.Is(info.DESCRIPTOR):
                detail.Unpack(info)
                return info.reason, dict(sorted(info.metadata.items()))
    except DecodeError:
        pass  # not of a nappe server
    return None, {}


def of_failure(failure: Any) -> Error:
    """The error of a session that failed (`nappe.v1.Failure`)."""
    metadata = {"step": str(failure.step), "time_seconds": repr(failure.time_seconds)}
    if failure.HasField("particle"):
        metadata["particle"] = str(failure.particle)
    if failure.HasField("value"):
        metadata["value"] = repr(failure.value)
    row = REASONS.get(failure.reason)
    code = row.code if row else None
    return class_of(failure.reason, code)(failure.message, reason=failure.reason, code=code, metadata=metadata)


def refused(message: str, field: str) -> Refused:
    """What this package refuses by itself, before anything is sent: the argument `field` is wrong."""
    return Refused(message, metadata={"field": field})
