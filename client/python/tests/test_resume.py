"""Readers of streams without a connection: what they ask for, where they go on after a break, when they give up."""

from __future__ import annotations

import logging
import random
from typing import Any

import numpy as np
import pytest

import nappe
from nappe import v1
from nappe._ask._resume import ChangeReader, DiagnosticsReader, FrameReader, Patience

BROKE = nappe.Unavailable("the line is cut", code="UNAVAILABLE")
LATE = nappe.Error("too late", code="DEADLINE_EXCEEDED")
NUMBERED = {"frame": FrameReader, "diagnostics": DiagnosticsReader}


def reader(kind: type[Any] = FrameReader, **other: Any) -> Any:
    """A reader of session `flag`; every frame, unless it is told otherwise."""
    known: dict[str, Any] = {"every": True, "start": None, "rate": None, "patience": 60.0}
    if kind is FrameReader:
        known |= {"fields": ("positions",), "precision": "f32", "grid": None, "paced": False}
    return kind(("flag", ""), **(known | other))


def topology(uid: str = "u-1", index: int = 0, count: int = 1, **other: Any) -> Any:
    """A message with a topology of two particles in one body, or a piece of it."""
    body = v1.BodyTopology(name="flag", particle_count=2, pins_u32=np.array([index], "<u4").tobytes())
    told = {"topology_id": 7, "particle_count": 2, "session_uid": uid, **other}
    return v1.WatchFramesResponse(topology=v1.Topology(bodies=[body], chunk=v1.Chunk(index=index, count=count), **told))


def frame(number: int, *fields: str, index: int = 0, count: int = 1, **other: Any) -> Any:
    """A message with a frame, or with a piece that has one of its particles."""
    data = np.full(3 * (2 if count == 1 else 1), number, "<f4").tobytes()
    parts = [
        v1.FieldData(field=getattr(v1, f"FIELD_{field}"), encoding=v1.ENCODING_RAW_F32, first_particle=index, data=data)
        for field in fields or ("POSITIONS",)
    ]
    chunk = v1.Chunk(index=index, count=count)
    return v1.WatchFramesResponse(frame=v1.Frame(frame=number, topology_id=7, fields=parts, chunk=chunk, **other))


def diagnostics(number: int) -> Any:
    return v1.WatchDiagnosticsResponse(diagnostics=v1.Diagnostics(frame=number, step=4 * number))


def begun(kind: str, **other: Any) -> tuple[Any, Any]:
    """A reader whose stream has begun, and what makes a message of a number for it."""
    made = reader(NUMBERED[kind], **other)
    if kind == "frame":
        assert made.take(topology()) is None
        return made, frame
    return made, diagnostics


def resumed(made: Any, kind: str) -> None:
    """The stream begins once more, as every one does."""
    if kind == "frame":
        assert made.take(topology()) is None


def expired(oldest: str | None, kind: type[nappe.Error] = nappe.Expired) -> nappe.Error:
    return kind("gone", code="OUT_OF_RANGE", metadata={} if oldest is None else {"oldest_frame": oldest})


def test_a_stream_of_every_frame_is_asked_for_from_its_start() -> None:
    asked = {"session_id": "flag", "delivery": v1.DELIVERY_EVERY}
    plain = {"fields": [v1.FIELD_POSITIONS], "encoding": v1.ENCODING_RAW_F32}
    assert reader().request() == v1.WatchFramesRequest(**asked, **plain, from_frame=0)
    made = reader(start=5, fields=("stress", "velocities"), precision="f64", grid="smoke", paced=True)
    assert made.request() == v1.WatchFramesRequest(
        **asked,
        from_frame=5,
        fields=[v1.FIELD_STRESS_NORM, v1.FIELD_VELOCITIES],
        encoding=v1.ENCODING_RAW_F64,
        grid=v1.GridRequest(all=v1.AllNodes()),
        pace_to_watcher=True,
    )
    assert made.method == "WatchFrames"
    assert reader(DiagnosticsReader, start=5).request() == v1.WatchDiagnosticsRequest(**asked, from_frame=5)


def test_a_stream_of_the_newest_is_asked_for_without_a_number() -> None:
    asked = {"session_id": "flag", "delivery": v1.DELIVERY_LATEST}
    plain = {"fields": [v1.FIELD_POSITIONS], "encoding": v1.ENCODING_RAW_F32}
    newest = reader(every=False, rate=20, paced=True).request()
    assert newest == v1.WatchFramesRequest(**asked, **plain, max_rate_hz=20.0)
    assert not newest.HasField("from_frame") and not newest.pace_to_watcher
    for kind in (ChangeReader, DiagnosticsReader):
        asks = reader(kind, every=False, rate=1.0)
        assert (asks.method, asks.request().delivery) == ("WatchDiagnostics", v1.DELIVERY_LATEST)
        assert asks.request() == v1.WatchDiagnosticsRequest(**asked, max_rate_hz=1.0)


@pytest.mark.parametrize(
    ("other", "field"),
    [
        ({"rate": 20.0}, "rate"),
        ({"every": False, "rate": float("nan")}, "rate"),
        ({"every": False, "start": 0}, "start"),
        ({"start": -1}, "start"),
        ({"start": True}, "start"),
        ({"start": 1.0}, "start"),
        ({"patience": float("inf")}, "patience"),
        ({"fields": ("mass",)}, "fields"),
        ({"precision": "f16"}, "precision"),
        ({"grid": "fog"}, "grid"),
    ],
)
def test_what_does_not_fit_a_stream_is_refused_before_it_is_asked_for(other: dict[str, Any], field: str) -> None:
    with pytest.raises(nappe.Refused) as told:
        reader(**other)
    assert told.value.field == field


def test_the_uid_of_the_session_is_that_of_the_topology() -> None:
    made = reader()
    assert made.request().session_uid == ""
    made.take(topology("u-9", count=2))
    assert (made.request().session_id, made.request().session_uid) == ("flag", "u-9")


@pytest.mark.parametrize("kind", NUMBERED)
@pytest.mark.parametrize("start", [None, 0, 5])
def test_after_a_break_the_frame_after_the_last_is_asked_for(kind: str, start: int | None) -> None:
    made, message = begun(kind, start=start)
    first = start or 0
    for last in range(first, first + 4):
        assert made.take(message(last)) is not None
        for error in (BROKE, LATE):
            made.failed(error, 0.0)
            assert made.request().from_frame == last + 1
        resumed(made, kind)


def test_a_frame_that_was_not_whole_when_the_line_broke_is_asked_for_again() -> None:
    made, _ = begun("frame")
    assert made.take(frame(0)).number == 0
    assert made.take(frame(1, index=0, count=2)) is None
    made.failed(BROKE, 0.0)
    assert made.request().from_frame == 1
    resumed(made, "frame")
    assert made.take(frame(1, index=0, count=2)) is None
    whole = made.take(frame(1, index=1, count=2))
    assert whole.number == 1 and whole.positions.tolist() == [[1, 1, 1], [1, 1, 1]]
    assert made.request().from_frame == 2


def test_the_rest_of_a_frame_from_before_a_break_is_no_frame() -> None:
    made, _ = begun("frame")
    assert made.take(frame(0, index=0, count=2)) is None
    made.failed(BROKE, 0.0)
    resumed(made, "frame")
    with pytest.raises(nappe.Error, match="piece 1 of 2 came where piece 0 was next"):
        made.take(frame(0, index=1, count=2))


@pytest.mark.parametrize("kind", NUMBERED)
@pytest.mark.parametrize("number", [0, 1, 3, 2**61])
def test_of_every_frame_none_comes_twice_and_none_is_left_out(kind: str, number: int) -> None:
    made, message = begun(kind)
    assert made.take(message(0)) is not None and made.take(message(1)) is not None
    made.failed(BROKE, 0.0)
    resumed(made, kind)
    with pytest.raises(nappe.Error, match=f"frame {number} of session 'flag' came where 2 was next"):
        made.take(message(number))
    assert made.request().from_frame == 2


@pytest.mark.parametrize("kind", NUMBERED)
def test_the_first_of_every_frame_is_the_one_that_was_asked_for(kind: str) -> None:
    for start, number in ((None, 1), (5, 4), (5, 6)):
        made, message = begun(kind, start=start)
        with pytest.raises(nappe.Error, match=f"frame {number} .* where {start or 0} was next"):
            made.take(message(number))


def test_of_the_newest_frames_some_may_be_left_out() -> None:
    made, _ = begun("frame", every=False)
    assert [made.take(frame(number, dropped_count=2)).number for number in (3, 6, 9)] == [3, 6, 9]
    made.failed(BROKE, 0.0)
    resumed(made, "frame")
    assert made.take(frame(20, dropped_count=10)).dropped == 10
    assert not made.request().HasField("from_frame")


@pytest.mark.parametrize("count", [1, 2])
def test_a_topology_that_comes_again_and_is_the_same_stays_the_same_object(count: int) -> None:
    made = reader()
    seen = []
    for number in range(3):
        for index in range(count):
            assert made.take(topology(index=index, count=count)) is None
        seen.append(made.take(frame(number)).topology)
        made.failed(BROKE, 0.0)
    assert seen[0] is seen[1] is seen[2] and seen[0].pins.tolist() == list(range(count))


def test_a_topology_that_is_another_one_is_told_by_its_object() -> None:
    made, _ = begun("frame")
    before = made.take(frame(0)).topology
    made.take(topology(colliders=[v1.ColliderShape(name="c", sphere=v1.SphereShape(radius=1.0))]))
    after = made.take(frame(1)).topology
    assert after is not before and len(after.colliders) == 1 and before.colliders == ()


def test_a_frame_before_its_topology_is_whole_is_refused() -> None:
    made, _ = begun("frame")
    assert made.take(frame(0)) is not None
    made.failed(BROKE, 0.0)
    assert made.take(topology(count=2)) is None
    with pytest.raises(nappe.Error, match="topology 7, which did not come"):
        made.take(frame(1))


def test_arrays_that_were_asked_for_must_come() -> None:
    made, _ = begun("frame", fields=("positions", "velocities"))
    assert made.take(frame(0, "POSITIONS", "VELOCITIES")).fields == ("positions", "velocities")
    with pytest.raises(nappe.Error, match="velocities"):
        made.take(frame(1))
    assert begun("frame", fields="positions")[0].take(frame(0)).fields == ("positions",)


@pytest.mark.parametrize("kind", NUMBERED)
@pytest.mark.parametrize("error", [nappe.Expired, nappe.TooSlow])
def test_without_a_start_the_oldest_frame_that_is_kept_will_do(
    kind: str, error: type[nappe.Error], caplog: pytest.LogCaptureFixture
) -> None:
    made = reader(NUMBERED[kind])
    with caplog.at_level(logging.WARNING, "nappe"):
        assert made.failed(expired("40", error), 0.0) == 0.0
        assert made.request().from_frame == 40
        # By the time that it was asked for, that one was gone too.
        assert made.failed(expired("55", error), 0.0) == 0.0
    assert [record.getMessage() for record in caplog.records] == [
        "frames 0 to 39 of session flag are no longer kept",
        "frames 40 to 54 of session flag are no longer kept",
    ]
    resumed(made, kind)
    assert made.take(frame(55) if kind == "frame" else diagnostics(55)) is not None
    assert made.request().from_frame == 56 and made.reconnects == 0


@pytest.mark.parametrize("kind", NUMBERED)
def test_a_frame_that_was_named_and_is_gone_is_an_error(kind: str) -> None:
    for start in (0, 5):
        made = reader(NUMBERED[kind], start=start)
        with pytest.raises(nappe.Expired):
            made.failed(expired("40"), 0.0)
    made, message = begun(kind)
    assert made.take(message(0)) is not None
    made.failed(BROKE, 0.0)
    for error in (nappe.Expired, nappe.TooSlow):
        with pytest.raises(error):
            made.failed(expired("40", error), 0.0)
    with pytest.raises(nappe.Expired):
        reader(NUMBERED[kind], every=False).failed(expired("40"), 0.0)


@pytest.mark.parametrize("oldest", [None, "0", "-1", "", "soon", "²"])
def test_an_oldest_frame_that_leads_nowhere_is_the_error_itself(oldest: str | None) -> None:
    with pytest.raises(nappe.Expired):
        reader().failed(expired(oldest), 0.0)


@pytest.mark.parametrize(
    "error",
    [
        nappe.NotFound("gone", code="NOT_FOUND"),
        nappe.Refused("no", code="INVALID_ARGUMENT"),
        nappe.Diverged("not finite", code="FAILED_PRECONDITION"),
        nappe.TooSlow("slow", code="RESOURCE_EXHAUSTED"),
        nappe.Unauthenticated("who?", code="UNAUTHENTICATED"),
        nappe.Error("no code"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_an_error_that_no_retry_helps_is_raised_at_once(error: nappe.Error) -> None:
    made, message = begun("diagnostics")
    with pytest.raises(type(error)) as told:
        made.failed(error, 0.0)
    assert told.value is error
    assert made.take(message(0)) is not None and made.reconnects == 0


def test_an_error_that_may_pass_is_waited_out() -> None:
    assert all(0.05 <= reader().failed(error, 0.0) <= 0.1 for error in (BROKE, LATE))


def test_waits_double_up_to_the_longest_and_are_drawn_from_half_to_all_of_it() -> None:
    for draw, part in ((0.0, 0.5), (0.5, 0.75), (1.0, 1.0)):
        patience = Patience(1000.0)
        waits = [patience.wait(0.0, draw) for _ in range(9)]
        assert waits == pytest.approx([part * wait for wait in (0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5, 5, 5)])


def test_a_wait_is_drawn_at_random_where_no_draw_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    for drawn in (0.0, 0.2):
        monkeypatch.setattr(random, "random", lambda drawn=drawn: drawn)
        assert reader().failed(BROKE, 0.0) == pytest.approx(0.05 + 0.05 * drawn)


def test_many_failures_do_not_overflow() -> None:
    patience = Patience(1.0)
    assert [patience.wait(0.0, 1.0) for _ in range(5000)][-1] == 1.0


def test_patience_counts_over_all_attempts_of_a_break() -> None:
    patience = Patience(2.0)
    assert patience.wait(100.0, 1.0) == pytest.approx(0.1)
    assert patience.wait(101.0, 1.0) == pytest.approx(0.2)
    # The last wait ends when patience does.
    assert patience.wait(101.75, 1.0) == pytest.approx(0.25)
    assert patience.wait(102.0, 1.0) is None and patience.wait(103.0, 1.0) is None


@pytest.mark.parametrize("seconds", [0, -1.0])
def test_without_patience_the_first_failure_ends_it(seconds: float) -> None:
    assert Patience(seconds).wait(0.0) is None
    with pytest.raises(nappe.Unavailable):
        reader(patience=seconds).failed(BROKE, 0.0)


def test_a_message_renews_patience_and_makes_waits_short_again() -> None:
    patience = Patience(2.0)
    assert [patience.wait(now, 1.0) for now in (0.0, 1.0)] == pytest.approx([0.1, 0.2])
    patience.arrived()
    assert patience.wait(50.0, 1.0) == pytest.approx(0.1)

    made = reader(patience=2.0)
    assert made.failed(BROKE, 0.0) and made.take(v1.WatchFramesResponse(progress=v1.Progress(frame=3))) is None
    assert made.failed(BROKE, 50.0) <= 0.1
    with pytest.raises(nappe.Error) as told:
        made.failed(LATE, 52.0)
    assert told.value is LATE


def test_a_break_is_counted_and_logged_when_the_stream_is_back(caplog: pytest.LogCaptureFixture) -> None:
    made, _ = begun("frame")
    with caplog.at_level(logging.DEBUG, "nappe"):
        assert made.take(frame(0)) is not None
        for error in (LATE, LATE, BROKE):
            made.failed(error, 0.0)
        assert (made.reconnects, caplog.records) == (0, [])
        resumed(made, "frame")
        assert made.take(frame(1)) is not None
        assert made.reconnects == 1
        made.failed(LATE, 0.0)
        resumed(made, "frame")
        assert made.reconnects == 2
    assert [(record.name, record.levelname, record.getMessage()) for record in caplog.records] == [
        ("nappe", "WARNING", "the stream of session flag broke and is back: the line is cut"),
        ("nappe", "WARNING", "the stream of session flag broke and is back: too late"),
    ]


@pytest.mark.parametrize("kind", [FrameReader, DiagnosticsReader, ChangeReader])
def test_the_end_is_kept_and_a_stream_that_stops_without_it_is_an_error(kind: type[Any]) -> None:
    made = reader(kind, every=False)
    with pytest.raises(nappe.NotFound, match="'flag' stopped without its end"):
        made.over()
    response = v1.WatchFramesResponse if kind is FrameReader else v1.WatchDiagnosticsResponse
    assert made.take(response(end=v1.SessionEnd(frame=30, step=120, state_hash=2**64 - 1))) is None
    assert (made.end.frame, made.end.step, made.end.state_hash) == (30, 120, "f" * 16)
    made.over()


def test_what_is_not_a_frame_brings_none() -> None:
    made, _ = begun("frame")
    change = v1.StateChange(kind=v1.CHANGE_KIND_STATE, state=v1.SESSION_STATE_PLAYING)
    for event in ({}, {"change": change}, {"progress": v1.Progress(frame=9)}):
        assert made.take(v1.WatchFramesResponse(**event)) is None
    # An event of a newer server: field 1000, an empty message.
    assert made.take(v1.WatchFramesResponse.FromString(b"\xc2\x3e\x00")) is None
    assert made.take(frame(0)).number == 0 and made.end is None


def test_diagnostics_come_without_what_stands_between_them() -> None:
    made, _ = begun("diagnostics")
    assert made.take(v1.WatchDiagnosticsResponse(change=v1.StateChange(number=1))) is None
    assert made.take(v1.WatchDiagnosticsResponse()) is None
    read = made.take(diagnostics(0))
    assert isinstance(read, nappe.Diagnostics) and (read.frame, read.step, read.solve) == (0, 0, None)


def test_changes_come_as_words_and_diagnostics_do_not() -> None:
    made = reader(ChangeReader, every=False, rate=1.0)
    assert made.take(diagnostics(4)) is None
    failure = v1.Failure(reason="NOT_FINITE", message="gone", step=3, particle=0)
    told = {"number": 2, "state": v1.SESSION_STATE_FAILED, "failure": failure, "step": 3, "session_uid": "u-1"}
    read = made.take(v1.WatchDiagnosticsResponse(change=v1.StateChange(kind=v1.CHANGE_KIND_STATE, **told)))
    assert isinstance(read, nappe.Change)
    assert (read.number, read.kind, read.state, read.step, read.session_uid) == (2, "state", "failed", 3, "u-1")
    assert read.failure == nappe.Failure("NOT_FINITE", "gone", 3, 0.0, 0, None) and read.rejected is None
    assert made.take(v1.WatchDiagnosticsResponse(change=v1.StateChange(kind=v1.CHANGE_KIND_PRESENT))).failure is None
