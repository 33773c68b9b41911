"""What a caller gives is checked before a byte is sent: what is wrong is named, what is right becomes the message."""

from __future__ import annotations

import math
import uuid
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import nappe
from nappe import v1
from nappe._ask import _requests as requests

IDS = ("flag", "u-1")
PARTICLES = 10
LIMITS = {"max_changes_per_call": 4}
NO_WHOLE_NUMBERS: list[Any] = [-1, True, False, 1.0, 1.5, "1", None, math.nan, np.True_, np.float64(1), 2**63, [1]]
NOT_FINITE: list[Any] = [math.nan, math.inf, -math.inf, "x", None, [1.0], 1j, 10**400]


def refusal(ask: Callable[[], Any], field: str) -> str:
    """The message of what is refused, for the argument that is wrong."""
    with pytest.raises(nappe.Refused) as told:
        ask()
    assert told.value.field == field and told.value.reason is None
    return told.value.message


def vector(x: float, y: float, z: float) -> Any:
    return v1.Vector3(x=x, y=y, z=z)


def create(**other: Any) -> Any:
    given: dict[str, Any] = {
        "scene_name": "flag",
        "scene_text": None,
        "session_id": "",
        "precision": None,
        "thread_count": 0,
        "step_limit": None,
        "frame_interval_steps": 0,
        "rank_count": 0,
    }
    return requests.create(**(given | other))


def step(count: Any = 1, **other: Any) -> Any:
    given: dict[str, Any] = {"to": None, "wait": True, "changes": None, "frame": False, "precision": "f32"}
    given |= {"fields": ("positions",), "particles": PARTICLES}
    return requests.step(IDS, count, **(given | other))


def update(at_step: Any = 0, wait: bool = False, **changes: Any) -> Any:
    return requests.update(IDS, requests.changes(**changes), at_step, wait, PARTICLES)


def path(particle: Any = 3, times: Any = (0.5, 1.0), targets: Any = ((0, 1, 2), (3, 4, 5)), at_step: Any = 0) -> Any:
    return requests.path(IDS, particle, times, targets, at_step, False, PARTICLES, LIMITS)


def test_a_create_with_nothing_given_leaves_all_to_the_scene() -> None:
    call = create()
    uuid.UUID(call.message.request_id)
    assert call.message == v1.CreateSessionRequest(scene_name="flag", request_id=call.message.request_id)
    assert (call.name, call.limit) == ("CreateSession", 120.0)
    assert create().message.request_id != call.message.request_id


def test_a_create_has_all_that_is_given() -> None:
    text = "[world]\n"
    made = create(
        scene_text=text,
        session_id="calm",
        precision="f64",
        thread_count=np.int64(3),
        step_limit=0,
        frame_interval_steps=np.uint8(4),
        rank_count=2,
    ).message
    assert made == v1.CreateSessionRequest(
        session_id="calm",
        scene_text=text,
        precision=v1.PRECISION_F64,
        thread_count=3,
        step_limit=0,
        frame_interval_steps=4,
        rank_count=2,
        request_id=made.request_id,
    )
    assert made.HasField("step_limit") and made.WhichOneof("scene") == "scene_text"
    assert create(precision="f32").message.precision == v1.PRECISION_F32


@pytest.mark.parametrize("name", ["thread_count", "step_limit", "frame_interval_steps", "rank_count"])
@pytest.mark.parametrize("value", NO_WHOLE_NUMBERS, ids=repr)
def test_a_number_of_a_create_is_whole_and_not_negative(name: str, value: Any) -> None:
    if name == "step_limit" and value is None:
        return
    told = refusal(lambda: create(**{name: value}), name)
    allowed = "a whole number of at least 0" if name == "step_limit" else "a whole number, 0 to 4294967295"
    assert told == f"{name} is {value!r}; allowed: {allowed}"


@pytest.mark.parametrize("name", ["thread_count", "frame_interval_steps", "rank_count"])
def test_a_number_that_the_contract_has_no_room_for_is_refused(name: str) -> None:
    assert getattr(create(**{name: 2**32 - 1}).message, name) == 2**32 - 1
    assert name in refusal(lambda: create(**{name: 2**32}), name)


@pytest.mark.parametrize("value", ["F32", "f16", "", 32, True])
def test_a_precision_is_one_of_two_or_left_to_the_scene(value: Any) -> None:
    assert refusal(lambda: create(precision=value), "precision").startswith(f"precision is {value!r}; allowed: 'f32'")
    told = refusal(lambda: step(frame=True, precision=value), "precision")
    assert told == f"precision is {value!r}; allowed: 'f32', 'f64'"


def test_lists_are_asked_for_page_by_page() -> None:
    sessions, pending = requests.sessions("abc"), requests.pending(IDS, "abc")
    assert sessions.message == v1.ListSessionsRequest(page_size=200, page_token="abc")
    told = {"session_id": "flag", "session_uid": "u-1", "page_size": 200, "page_token": "abc"}
    assert pending.message == v1.ListPendingChangesRequest(**told)
    assert (sessions.limit, pending.limit, pending.name) == (10.0, 10.0, "ListPendingChanges")


def test_calls_about_a_session_name_its_uid_and_calls_that_wait_have_no_limit() -> None:
    ids = {"session_id": "flag", "session_uid": "u-1"}
    assert requests.of_session("GetSession", IDS, 10.0).message == v1.GetSessionRequest(**ids)
    assert requests.of_session("PauseSession", IDS, wait=True).message == v1.PauseSessionRequest(**ids, wait=True)
    assert requests.play(IDS, 2).message == v1.PlaySessionRequest(**ids, real_time_factor=2.0)
    fork = v1.ForkSessionRequest(**ids, new_session_id="calm")
    assert requests.fork(IDS, "calm", None).message == fork and not fork.HasField("step_limit")
    fork.step_limit = 0
    assert requests.fork(IDS, "calm", 0).message == fork
    assert "step_limit is -1" in refusal(lambda: requests.fork(IDS, "calm", -1), "step_limit")
    for call in (requests.of_session("PauseSession", IDS), requests.play(IDS, 0), step(), update(), path()):
        assert call.limit is None
    assert requests.info().limit == 10.0 and requests.info().message == v1.GetServerInfoRequest()


def test_a_link_is_the_address_of_the_page_with_a_code() -> None:
    answer = v1.MakeLinkResponse(code="0a")
    everything = requests.link("http://127.0.0.1:1", "", 0, 0, 0)
    assert everything.message == v1.MakeLinkRequest() and everything.read(answer) == "http://127.0.0.1:1/#0a"
    narrow = requests.link("http://127.0.0.1:1", "some", 1, 60, 43200)
    assert narrow.message == v1.MakeLinkRequest(session_id="some", forks=1, uses=60, seconds=43200)
    assert narrow.read(answer) == "http://127.0.0.1:1/?session=some#0a"
    for field, values in (("forks", (-1, 0, 0)), ("uses", (0, 1.5, 0)), ("seconds", (0, 0, 2**32))):
        assert refusal(lambda values=values: requests.link("http://127.0.0.1:1", "some", *values), field)
    assert "unix:x.sock" in refusal(lambda: requests.link("unix:x.sock", "", 0, 0, 0), "url")


@pytest.mark.parametrize("value", NOT_FINITE, ids=lambda value: str(value)[:8])
def test_a_factor_and_a_drag_are_finite_numbers(value: Any) -> None:
    told = f"is {value!r}; allowed: a finite number"
    assert told in refusal(lambda: requests.play(IDS, value), "real_time_factor")
    if value is not None:
        assert told in refusal(lambda: update(drag=value), "drag")
        assert told in refusal(lambda: update(pins={3: (0, 0, 0)}, duration=value), "duration")


def test_steps_are_counted_or_go_to_a_step() -> None:
    ids = {"session_id": "flag", "session_uid": "u-1"}
    assert step(5).message == v1.StepSessionRequest(**ids, step_count=5, wait=True)
    assert step(5, to=40, wait=False).message == v1.StepSessionRequest(**ids, to_step=40)
    assert step(to=0).message.HasField("to_step")
    assert step(5, changes={}).message.HasField("changes") is False
    for count in (0, *NO_WHOLE_NUMBERS):
        assert refusal(lambda count=count: step(count), "n") == f"n is {count!r}; allowed: a whole number of at least 1"
    for to in NO_WHOLE_NUMBERS:
        if to is not None:
            assert f"to is {to!r};" in refusal(lambda to=to: step(to=to), "to")


def test_a_step_has_changes_before_it_and_a_frame_after_it() -> None:
    made = step(2, changes={"wind": (1, 0, 0)}, frame=True, fields=("velocities", "stress"), precision="f64").message
    expected = v1.StepSessionRequest(session_id="flag", session_uid="u-1", step_count=2, wait=True)
    expected.changes.wind.x = 1.0
    expected.frame.fields.extend([v1.FIELD_VELOCITIES, v1.FIELD_STRESS_NORM])
    expected.frame.encoding = v1.ENCODING_RAW_F64
    assert made == expected
    assert "frame needs wait" in refusal(lambda: step(frame=True, wait=False), "frame")
    assert "wind" in refusal(lambda: step(changes={"wind": (1, 0)}), "wind")


def test_the_frame_of_an_answer_is_read_and_checked() -> None:
    answer = v1.StepSessionResponse(session=v1.Session(particle_count=1))
    assert requests.frame_of(answer) is None
    answer.frame.step = 3
    answer.frame.fields.add(field=1, encoding=1, data=np.arange(3, dtype="<f4").tobytes())
    frame = requests.frame_of(answer)
    assert frame is not None and frame.step == 3 and frame.positions.tolist() == [[0, 1, 2]]
    answer.session.particle_count = 2
    with pytest.raises(nappe.Error, match="cover 1 of 2 particles"):
        requests.frame_of(answer)


def test_the_frame_of_an_answer_takes_no_more_memory_than_came() -> None:
    answer = v1.StepSessionResponse(session=v1.Session(particle_count=2**60))
    for first in range(2):
        answer.frame.fields.add(field=1, encoding=1, first_particle=first, data=b"\0" * 12)
    with pytest.raises(nappe.Error, match="particles"):
        requests.frame_of(answer)


def test_an_update_has_every_change_in_its_field() -> None:
    made = update(
        7,
        True,
        gravity=(0, -9.81, 0),
        wind=np.array([1, 2, 3], np.float32),
        drag=0.5,
        stiffness=100,
        damping={"bend": 5, "all": np.float32(0.25)},
        body="flag",
        pins={np.int64(3): [0, 1, 2], 9: np.zeros(3)},
        duration=0.5,
    ).message
    expected = v1.UpdateParametersRequest(session_id="flag", session_uid="u-1", at_step=7, wait=True, drag=0.5)
    expected.gravity.CopyFrom(vector(0, -9.81, 0))
    expected.wind.CopyFrom(vector(1, 2, 3))
    expected.springs.add(body="flag", kind=v1.SPRING_KIND_UNSPECIFIED, stiffness=100.0)
    expected.springs.add(body="flag", kind=v1.SPRING_KIND_BEND, damping=5.0)
    expected.springs.add(body="flag", kind=v1.SPRING_KIND_UNSPECIFIED, damping=0.25)
    expected.pins.add(particle=3, target=vector(0, 1, 2), duration_seconds=0.5)
    expected.pins.add(particle=9, target=vector(0, 0, 0), duration_seconds=0.5)
    assert made == expected


def test_what_is_not_given_is_not_sent_and_a_zero_is() -> None:
    empty = v1.UpdateParametersRequest(session_id="flag", session_uid="u-1")
    assert update(gravity=None, drag=None, pins=None).message == empty
    zero = update(gravity=(0, 0, 0), drag=0, stiffness=0).message
    assert zero.HasField("gravity") and zero.HasField("drag")
    assert zero.springs[0].HasField("stiffness") and not zero.springs[0].HasField("damping")
    assert update(pins={3: (0, 0, 0)}).message.pins[0].duration_seconds == 0.0
    kinds = [update(stiffness={kind: 1}).message.springs[0].kind for kind in ("stretch", "shear", "bend")]
    assert kinds == [v1.SPRING_KIND_STRETCH, v1.SPRING_KIND_SHEAR, v1.SPRING_KIND_BEND]


@pytest.mark.parametrize(
    ("changes", "field", "told"),
    [
        ({"gravity": (0, -9.81)}, "gravity", "gravity is of shape (2,); allowed: (3)"),
        ({"gravity": -9.81}, "gravity", "gravity is of shape (); allowed: (3)"),
        ({"wind": [[1, 2, 3]]}, "wind", "wind is of shape (1, 3); allowed: (3)"),
        ({"wind": (0, math.nan, 1)}, "wind", "wind[1] is nan; allowed: a finite number"),
        ({"gravity": (0, 0, -math.inf)}, "gravity", "gravity[2] is -inf; allowed"),
        ({"wind": (True, False, True)}, "wind", "wind is an array of bool; allowed: numbers"),
        ({"wind": ("1", "2", "3")}, "wind", "wind is an array of <U1; allowed: numbers"),
        ({"wind": (1j, 0, 0)}, "wind", "wind is an array of complex128; allowed: numbers"),
        ({"stiffness": {"twist": 5}}, "stiffness", "kind 'twist'; allowed: all, stretch, shear, bend"),
        ({"damping": {"bend": math.nan}}, "damping['bend']", "damping['bend'] is nan"),
        ({"stiffness": math.inf}, "stiffness['all']", "is inf; allowed: a finite number"),
        ({"pins": {10: (0, 0, 0)}}, "pins", "pins names particle 10; allowed: 0 to 9"),
        ({"pins": {-1: (0, 0, 0)}}, "pins", "pins is -1; allowed: a whole number"),
        ({"pins": {True: (0, 0, 0)}}, "pins", "pins is True; allowed: a whole number"),
        ({"pins": {1.0: (0, 0, 0)}}, "pins", "pins is 1.0; allowed: a whole number"),
        ({"pins": {3: (0, 0)}}, "pins[3]", "pins[3] is of shape (2,); allowed: (3)"),
        ({"pins": {3: (0, math.nan, 0)}}, "pins[3]", "pins[3][1] is nan"),
        ({"gravty": (0, 0, 0)}, "gravty", "no change is called 'gravty'; there are: gravity, wind, drag"),
    ],
)
def test_a_change_that_cannot_be_is_named(changes: Any, field: str, told: str) -> None:
    assert told in refusal(lambda: update(**changes), field)
    assert told in refusal(lambda: step(changes=changes), field)


@pytest.mark.parametrize("value", [-1, True, 1.5, "3", None])
def test_the_step_of_a_change_is_a_whole_number(value: Any) -> None:
    assert f"at_step is {value!r};" in refusal(lambda: update(value, drag=1.0), "at_step")
    assert f"at_step is {value!r};" in refusal(lambda: path(at_step=value), "at_step")


def test_a_path_is_sent_point_after_point() -> None:
    made = path(np.int32(9), np.array([0.5, 1.0], np.float32), np.arange(6).reshape(2, 3).T.copy().T, 4).message
    expected = v1.UpdateParametersRequest(session_id="flag", session_uid="u-1", at_step=4)
    expected.paths.add(particle=9, times_seconds=[0.5, 1.0], targets=[0, 1, 2, 3, 4, 5])
    assert made == expected


@pytest.mark.parametrize(
    ("given", "field", "told"),
    [
        ({"times": (0.0, 1.0)}, "times", "times[0] is 0 s; allowed: above 0"),
        ({"times": (-1.0, 1.0)}, "times", "times[0] is -1 s"),
        ({"times": (1.0, 1.0)}, "times", "times[1] is 1 s; allowed: above 0 and above the time before"),
        ({"times": (1.0, 0.5)}, "times", "times[1] is 0.5 s"),
        ({"times": (1.0, math.inf)}, "times", "times[1] is inf; allowed: a finite number"),
        ({"times": (math.nan, 1.0)}, "times", "times[0] is nan"),
        ({"times": (1.0,)}, "times", "1 times came with 2 targets"),
        ({"times": (), "targets": np.zeros((0, 3))}, "times", "0 times came with 0 targets"),
        ({"times": range(1, 6), "targets": np.zeros((5, 3))}, "times", "times has 5 points; allowed: at most 4 in one"),
        ({"times": 1.0}, "times", "times is of shape (); allowed: (n)"),
        ({"targets": (0, 1, 2)}, "targets", "targets is of shape (3,); allowed: (n, 3)"),
        ({"targets": ((0, 1), (2, 3))}, "targets", "targets is of shape (2, 2); allowed: (n, 3)"),
        ({"targets": ((0, 1, 2), (0, 1))}, "targets", "targets is no array"),
        ({"targets": ((0, 1, 2), (3, 4, math.nan))}, "targets", "targets[1][2] is nan"),
        ({"particle": 10}, "particle", "particle names particle 10; allowed: 0 to 9"),
        ({"particle": -1}, "particle", "particle is -1"),
        ({"particle": True}, "particle", "particle is True"),
    ],
)
def test_a_path_that_cannot_be_gone_is_named(given: Any, field: str, told: str) -> None:
    assert told in refusal(lambda: path(**given), field)


def test_fields_are_names_each_of_them_once() -> None:
    every = ["positions", "velocities", "plastic_ratio", "stress", "force", "acceleration"]
    wire = [v1.FIELD_POSITIONS, v1.FIELD_VELOCITIES, v1.FIELD_PLASTIC_RATIO, v1.FIELD_STRESS_NORM]
    wire += [v1.FIELD_FORCES, v1.FIELD_ACCELERATIONS]
    assert requests.field_numbers(every) == wire and requests.field_numbers(every[::-1]) == wire[::-1]
    assert requests.field_numbers(("stress", "positions", "stress")) == [wire[3], wire[0]]
    assert requests.field_numbers("stress") == [wire[3]]
    there = "there are: positions, velocities, plastic_ratio, stress, force, acceleration"
    for fields, name in ((("positions", "mass"), "mass"), ("mass", "mass"), (("Positions",), "Positions")):
        told = f"no array is called {name!r}; {there}"
        assert refusal(lambda fields=fields: requests.field_numbers(fields), "fields") == told
    assert there in refusal(lambda: requests.field_numbers(()), "fields")


def test_a_grid_is_smoke_or_a_slice() -> None:
    assert requests.grid_request(None) is None
    smoke = requests.grid_request("smoke")
    assert smoke == v1.GridRequest(all=v1.AllNodes()) and smoke.WhichOneof("selection") == "all"
    for text, axis, at in (("x=0", "X", 0.0), ("y=0.5", "Y", 0.5), ("z=-1e-3", "Z", -1e-3)):
        expected = v1.SliceNodes(axis=getattr(v1, f"AXIS_{axis}"), coordinate=at)
        made = requests.grid_request(f"slice:{text}")
        assert made == v1.GridRequest(slice=expected) and made.WhichOneof("selection") == "slice"


@pytest.mark.parametrize(
    "text", ["", "Smoke", "slice", "slice:", "slice:y", "slice:y=", "slice:=1", "slice:w=1", "slice:Y=1", "y=0.5"]
)
def test_another_grid_is_refused_with_those_that_there_are(text: str) -> None:
    told = refusal(lambda: requests.grid_request(text), "grid")
    assert told.startswith(f"grid is {text!r}; allowed: 'smoke'") and "'slice:y=0.5'" in told


@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e999", "half", "0,5", "1=2"])
def test_a_slice_is_at_a_finite_coordinate(number: str) -> None:
    assert "grid is" in refusal(lambda: requests.grid_request(f"slice:y={number}"), "grid")


def test_an_array_is_contiguous_of_its_type_and_of_any_length_where_it_may_be() -> None:
    given = np.asfortranarray(np.arange(6, dtype=">i2").reshape(2, 3))
    read = requests.array(given, "points", (-1, 3))
    assert read.flags.c_contiguous and read.dtype == np.dtype("<f8") and read.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert requests.array([], "times", (-1,)).shape == (0,)
    assert requests.array(np.ones((2, 3), np.uint8), "triangles", (-1, 3), "<i8").dtype == np.dtype("<i8")
    assert requests.array(given.astype("<f8"), "points", (2, -1)).shape == (2, 3)


def test_a_number_too_large_for_its_type_is_told_as_it_was_given() -> None:
    told = refusal(lambda: requests.array([[0.5, 1e300]], "uv", (-1, 2), "<f4"), "uv")
    assert told == "uv[0][1] is 1e+300; allowed: a finite number"
    assert "allowed: numbers" in refusal(lambda: requests.array([10**400], "times", (-1,)), "times")


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"pins": [(0, 0, 0)]}, "pins"),
        ({"body": 5, "stiffness": 1.0}, "body"),
        ({"drag": True}, "drag"),
        ({"drag": "5"}, "drag"),
        ({"stiffness": {"bend": False}}, "stiffness['bend']"),
    ],
)
def test_a_change_of_a_wrong_type_is_named(changes: Any, name: str) -> None:
    assert refusal(lambda: update(7, True, **changes), name).startswith(f"{name} is ")


def test_a_grid_and_fields_of_a_wrong_type_are_named() -> None:
    assert refusal(lambda: requests.grid_request(5), "grid").startswith("grid is 5")  # type: ignore[arg-type]
    assert "None" in refusal(lambda: requests.field_numbers(None), "fields")  # type: ignore[arg-type]
    assert refusal(lambda: requests.encoding([]), "precision").startswith("precision is []")  # type: ignore[arg-type]
