"""Ctrl-C while a call of gRPC is waited for, and what is said of the session that it pauses."""

from __future__ import annotations

from nappe._server._properties import SessionProperties
from nappe._wire._errors import Error


def is_ctrl_c(error: BaseException) -> bool:
    """Whether an error is Ctrl-C; within a wait of gRPC it may come as an error of the lock that it waits for."""
    return isinstance(error, KeyboardInterrupt) or (
        isinstance(error, RuntimeError) and isinstance(error.__context__, KeyboardInterrupt)
    )


def paused_words(session: SessionProperties, error: Error | None) -> str:
    """How a session stands that was told to pause; `error`: why it did not answer."""
    if error is not None:
        return f"session {session.id!r} was told to pause, but it may go on: {error.message}"
    if session.state != "paused":
        return f"session {session.id!r} is {session.state} after step {session.steps_taken}"
    return (
        f"session {session.id!r} is paused after step {session.steps_taken}: step() or play() goes on, and "
        f"trajectory(stop={session.steps_taken}) returns the frames so far"
    )
