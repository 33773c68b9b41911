"""Air, forces and states become messages, and come back as values; what is wrong is named before a byte is sent."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from test_requests import IDS, PARTICLES, refusal, step, update, vector

from nappe import Air, Diagnostics, Parameters, v1
from nappe._ask import _requests as requests
from nappe._wire._contract import ENUMS
from nappe._wire._diagnostics import diagnostics_array
from nappe._wire._pending import Pending, read_pending
from nappe._wire._reading import read, word
from nappe._wire._values import Accepted, Change

ROWS = np.arange(6.0).reshape(2, 3)


def expected(**fields: Any) -> Any:
    return v1.UpdateParametersRequest(session_id="flag", session_uid="u-1", **fields)


def place(body: Any = "cloth", positions: Any = ROWS, velocities: Any = None, at_step: Any = 0) -> Any:
    return requests.place(IDS, body, positions, velocities, at_step, False, PARTICLES)


def pending(message: Any) -> Pending:
    return read_pending(v1.PendingChange(changes=message))


def test_the_air_has_what_is_given_and_the_body_that_is_named() -> None:
    made = update(air={"density": 1, "lift": np.float32(0.5)}, body="flag", stiffness=5).message
    assert made.air[0] == v1.AirUpdate(body="flag", density=1.0, lift=0.5) and len(made.air) == 1
    assert made.springs[0].body == "flag"
    zero = update(air=dict.fromkeys(("density", "normal", "lift", "tangential"), 0)).message.air[0]
    assert zero == v1.AirUpdate(density=0.0, normal=0.0, lift=0.0, tangential=0.0)
    assert not made.air[0].HasField("normal") and zero.HasField("normal")
    assert len(update(body="flag").message.air) == 0


@pytest.mark.parametrize(
    ("given", "body", "force"),
    [
        ((0, 1, 2), "cloth", v1.ForceUpdate(force=vector(0, 1, 2))),
        (np.zeros(3, np.float32), "cloth", v1.ForceUpdate(force=vector(0, 0, 0))),
        (ROWS.tolist(), "a b", v1.ForceUpdate(forces_f64=ROWS.astype("<f8").tobytes())),
        (np.asfortranarray(ROWS), "cloth", v1.ForceUpdate(forces_f64=ROWS.astype("<f8").tobytes())),
        (
            {np.int64(9): ROWS[0], 0: [3, 4, 5]},
            "cloth",
            v1.ForceUpdate(particles_u32=b"\x09\0\0\0\0\0\0\0", forces_f64=ROWS.astype("<f8").tobytes()),
        ),
    ],
    ids=["one", "zero", "lists", "array", "some"],
)
def test_forces_are_one_for_all_or_one_for_each_or_for_some(given: Any, body: str, force: Any) -> None:
    force.body = body
    assert update(forces={body: given}).message == expected(forces=[force])
    assert step(changes={"forces": {body: given}}).message.changes.forces[0] == force
    assert force.HasField("force") is not bool(force.forces_f64)


def test_forces_on_several_bodies_come_in_the_order_in_which_they_are_given() -> None:
    made = update(forces={"b": (0, 0, 1), "a": {3: (0, 0, 1)}}).message
    assert [force.body for force in made.forces] == ["b", "a"]
    assert update(forces={}, states={}).message == expected()


HOW: dict[str, Any] = {"frequency": 20, "most": 30.5, "seconds": 0.5}


def test_pulls_name_particles_and_points_and_how_they_draw() -> None:
    drawn = v1.PullUpdate(body="cloth", points_f64=ROWS.astype("<f8").tobytes(), **HOW)
    assert update(pulls={"cloth": ROWS.tolist()}, **HOW).message == expected(pulls=[drawn])
    assert step(changes={"pulls": {"cloth": ROWS}, **HOW}).message.changes.pulls[0] == drawn
    ended = v1.PullUpdate(body="cloth", particles_u32=b"\4\0\0\0")
    some = v1.PullUpdate(particles_u32=b"\x09\0\0\0\0\0\0\0")
    some.MergeFrom(drawn)
    given = {np.int64(9): ROWS[0], 4: None, 0: [3, 4, 5]}
    made = update(pulls={"cloth": given, "sail": None}, **HOW).message
    assert made == expected(pulls=[ended, some, v1.PullUpdate(body="sail")])
    # What ends needs no numbers, and numbers alone change nothing.
    assert update(pulls={"cloth": {4: None}}).message == expected(pulls=[ended])
    assert update(pulls={}, **HOW).message == expected()


def test_a_state_is_positions_and_perhaps_velocities() -> None:
    where, fast = ROWS.astype("<f8").tobytes(), (-ROWS).astype("<f8").tobytes()
    at_rest = v1.StateUpdate(body="cloth", positions_f64=where)
    moving = v1.StateUpdate(body="cloth", positions_f64=where, velocities_f64=fast)
    assert place(at_step=7).message == expected(at_step=7, states=[at_rest])
    assert place(positions=ROWS.tolist(), velocities=(-ROWS).astype(np.float32)).message == expected(states=[moving])
    assert requests.place(IDS, "cloth", ROWS, None, 0, True, PARTICLES).message == expected(states=[at_rest], wait=True)
    assert (place().name, place().limit) == ("UpdateParameters", None)
    for given, state in ((ROWS, at_rest), ((ROWS, None), at_rest), ((ROWS, -ROWS), moving)):
        assert update(states={"cloth": given}).message == expected(states=[state])
        assert step(changes={"states": {"cloth": given}}).message.changes.states[0] == state


def test_a_reset_names_the_session() -> None:
    call = requests.reset(IDS)
    assert call.message == v1.ResetSessionRequest(session_id="flag", session_uid="u-1")
    assert (call.name, call.limit) == ("ResetSession", None)
    assert call.read(v1.ResetSessionResponse(effective_step=7, order=3)) == Accepted(7, 3)


AIR = "there are: density, normal, lift, tangential"


@pytest.mark.parametrize(
    ("changes", "field", "told"),
    [
        ({"air": 1.2}, "air", f"air is 1.2; allowed: a dict of numbers by their name; {AIR}"),
        ({"air": {}}, "air", f"air is empty; {AIR}"),
        ({"air": {"drag": 1}}, "air", f"air has no number 'drag'; {AIR}"),
        ({"air": {5: 1}}, "air", f"air has no number 5; {AIR}"),
        ({"air": {"density": math.nan}}, "air['density']", "air['density'] is nan; allowed: a finite number"),
        ({"air": {"lift": None}}, "air['lift']", "air['lift'] is None; allowed: a finite number"),
        ({"air": {"lift": 1}, "body": 5}, "body", "body is 5; allowed: the name of a cloth"),
        ({"forces": (0, 1, 0)}, "forces", "forces is (0, 1, 0); allowed: a dict of forces by the name of the body"),
        ({"forces": {0: (0, 1, 0)}}, "forces", "forces is 0; allowed: the name of a body"),
        ({"forces": {"": (0, 1, 0)}}, "forces", "forces is ''; allowed: the name of a body"),
        ({"forces": {"cloth": 1.0}}, "forces['cloth']", "forces['cloth'] is of shape (); allowed: (n, 3)"),
        ({"forces": {"cloth": (0, 1)}}, "forces['cloth']", "forces['cloth'] is of shape (2,); allowed: (3)"),
        ({"forces": {"cloth": ROWS.T}}, "forces['cloth']", "forces['cloth'] is of shape (3, 2); allowed: (n, 3)"),
        ({"forces": {"cloth": [(0, 1, 2), (3, 4)]}}, "forces['cloth']", "forces['cloth'] is no array"),
        ({"forces": {"cloth": (0, math.inf, 0)}}, "forces['cloth']", "forces['cloth'][1] is inf; allowed: a finite"),
        ({"forces": {"cloth": [(0, 0, math.nan)]}}, "forces['cloth']", "forces['cloth'][0][2] is nan"),
        ({"forces": {"cloth": "up"}}, "forces['cloth']", "forces['cloth'] is an array of <U2; allowed: numbers"),
        ({"forces": {"cloth": np.zeros((0, 3))}}, "forces['cloth']", "forces['cloth'] has 0 vectors; allowed: one for"),
        ({"forces": {"cloth": np.zeros((11, 3))}}, "forces['cloth']", "has 11 vectors; allowed: one for each particle"),
        ({"forces": {"cloth": {}}}, "forces['cloth']", "forces['cloth'] names no particle; allowed: a dict of vectors"),
        ({"forces": {"cloth": {-1: (0, 1, 0)}}}, "forces['cloth']", "forces['cloth'] is -1; allowed: a whole number"),
        ({"forces": {"cloth": {1.0: (0, 1, 0)}}}, "forces['cloth']", "forces['cloth'] is 1.0; allowed: a whole number"),
        ({"forces": {"cloth": {True: (0, 1, 0)}}}, "forces['cloth']", "forces['cloth'] is True; allowed: a whole"),
        ({"forces": {"cloth": {2**32: (0, 1, 0)}}}, "forces['cloth']", "names particle 4294967296; allowed: 0 to 9"),
        ({"forces": {"cloth": {3: (0, 1)}}}, "forces['cloth'][3]", "forces['cloth'][3] is of shape (2,); allowed: (3)"),
        ({"forces": {"cloth": {3: (0, math.nan, 0)}}}, "forces['cloth'][3]", "forces['cloth'][3][1] is nan"),
        ({"pulls": ROWS, **HOW}, "pulls", "allowed: a dict of points by the name of the body"),
        ({"pulls": {"": ROWS}, **HOW}, "pulls", "pulls is ''; allowed: the name of a body"),
        ({"pulls": {"cloth": ROWS[0]}, **HOW}, "pulls['cloth']", "pulls['cloth'] is of shape (3,); allowed: (n, 3)"),
        ({"pulls": {"cloth": np.zeros((11, 3))}, **HOW}, "pulls['cloth']", "pulls['cloth'] has 11 points; allowed: "),
        ({"pulls": {"cloth": {}}, **HOW}, "pulls['cloth']", "pulls['cloth'] names no particle; allowed: a dict of"),
        ({"pulls": {"cloth": {10: None}}}, "pulls['cloth']", "pulls['cloth'] names particle 10; allowed: 0 to 9"),
        ({"pulls": {"cloth": {3: (0, math.nan, 0)}}, **HOW}, "pulls['cloth'][3]", "pulls['cloth'][3][1] is nan"),
        ({"pulls": {"cloth": ROWS}, "most": 1, "seconds": 1}, "frequency", "frequency is missing"),
        ({"pulls": {"cloth": ROWS}, **HOW, "most": math.nan}, "most", "most is nan; allowed: a finite number"),
        ({"states": ROWS}, "states", "allowed: a dict of positions by the name of the body"),
        ({"states": {None: ROWS}}, "states", "states is None; allowed: the name of a body"),
        ({"states": {"cloth": ROWS[0]}}, "states['cloth']", "states['cloth'] is of shape (3,); allowed: (n, 3)"),
        (
            {"states": {"cloth": (ROWS, ROWS, 1)}},
            "states['cloth']",
            "states['cloth'] is a tuple of 3; allowed: positions",
        ),
        ({"states": {"cloth": (ROWS, ROWS[:1])}}, "states['cloth'][1]", "is of shape (1, 3); allowed: (2, 3)"),
        ({"states": {"cloth": (ROWS * math.nan, None)}}, "states['cloth'][0]", "states['cloth'][0][0][0] is nan"),
    ],
)
def test_what_cannot_act_is_named(changes: Any, field: str, told: str) -> None:
    assert told in refusal(lambda: update(**changes), field)
    assert told in refusal(lambda: step(changes=changes), field)


@pytest.mark.parametrize(
    ("given", "field", "told"),
    [
        ({"body": ""}, "body", "body is ''; allowed: the name of a body"),
        ({"body": 5}, "body", "body is 5; allowed: the name of a body"),
        ({"positions": (0, 1, 2)}, "positions", "positions is of shape (3,); allowed: (n, 3)"),
        ({"positions": [(0, 1, math.inf)]}, "positions", "positions[0][2] is inf; allowed: a finite number"),
        (
            {"positions": np.zeros((0, 3))},
            "positions",
            "positions has 0 vectors; allowed: one for each particle of the",
        ),
        ({"positions": np.zeros((11, 3))}, "positions", "positions has 11 vectors; allowed: one for each particle of"),
        ({"velocities": (0, 1, 2)}, "velocities", "velocities is of shape (3,); allowed: (2, 3)"),
        ({"velocities": [(0, 1, 2)]}, "velocities", "velocities is of shape (1, 3); allowed: (2, 3)"),
        (
            {"velocities": [(0, 1, 2), (-math.inf, 0, 0)]},
            "velocities",
            "velocities[1][0] is -inf; allowed: a finite number",
        ),
        ({"at_step": -1}, "at_step", "at_step is -1; allowed: a whole number of at least 0"),
    ],
)
def test_a_place_that_cannot_be_is_named(given: Any, field: str, told: str) -> None:
    assert told in refusal(lambda: place(**given), field)


def test_what_waits_is_told_as_it_was_given() -> None:
    air = pending(update(air={"density": 0.5, "lift": 0}, body="flag").message).changes
    assert air == {"air": [{"body": "flag", "density": 0.5, "lift": 0.0}]}
    assert pending(update(air={"normal": 1}).message).changes["air"] == [{"body": None, "normal": 1.0}]

    some = pending(update(forces={"flag": {4: (0, 1, 2), 7: (3, 4, 5)}, "sail": (0, 1, 2)}).message).changes["forces"]
    ((indices, forces),), ((all_of_them, force),) = some["flag"], some["sail"]
    assert indices.tolist() == [4, 7] and forces.tolist() == ROWS.tolist()
    assert all_of_them is None and force.tolist() == [0, 1, 2]

    pulls = pending(update(pulls={"flag": {4: (0, 1, 2)}, "sail": None}, **HOW).message).changes["pulls"]
    ((particles, points, *how),), (end,) = pulls["flag"], pulls["sail"]
    assert (particles.tolist(), points.tolist(), how) == ([4], [[0, 1, 2]], [20, 30.5, 0.5])
    assert end == (None, None, 0.0, 0.0, 0.0)

    twice = expected(forces=[v1.ForceUpdate(body="flag"), v1.ForceUpdate(body="flag", forces_f64=ROWS.tobytes())])
    first, second = pending(twice).changes["forces"]["flag"]
    assert (first[0], first[1].tolist()) == (None, [0, 0, 0]) and (second[0], second[1].shape) == (None, (2, 3))

    states = pending(update(states={"flag": ROWS, "sail": (ROWS, -ROWS)}).message).changes["states"]
    assert states["flag"][0].tolist() == ROWS.tolist() and states["flag"][1] is None
    assert states["sail"][1].tolist() == (-ROWS).tolist()
    upload = v1.StateUpdate(body="flag", upload_id="m-1")
    assert pending(expected(states=[upload])).changes == {"states": {"flag": "m-1"}}


def test_parameters_have_the_air_of_each_cloth_that_feels_some() -> None:
    cloths = [v1.ClothParameters(body="a"), v1.ClothParameters(body="b")]
    cloths[1].air.CopyFrom(v1.Air(density=1.2, normal=0.5, lift=2.0, tangential=0.02))
    still, blown = read(Parameters, v1.Parameters(cloths=cloths)).cloths
    assert still.air is None and blown.air == Air(density=1.2, normal=0.5, lift=2.0, tangential=0.02)


def test_parameters_have_the_forces_of_calls_as_calls_take_them() -> None:
    some = {4: (0.0, 1.0, 2.0), 7: (3.0, 4.0, 5.0)}
    given: Any = {"flag": some, "sail": (0.0, 1.0, 2.0), "net": {3: (6.0, 7.0, 8.0)}}
    sent = update(forces=given).message.forces
    same = v1.ForceUpdate(body="net", particles_u32=b"\3\0\0\0", force=vector(6, 7, 8))
    for forces in (sent, [*sent[:2], same]):
        told = read(Parameters, v1.Parameters(forces=forces)).forces
        assert told == given and list(told) == ["flag", "sail", "net"]
        assert update(forces=told).message.forces == sent
    assert read(Parameters, v1.Parameters()).forces == {}
    assert read(Parameters, v1.Parameters(forces=[v1.ForceUpdate(body="flag")])).forces == {"flag": None}
    each = v1.ForceUpdate(body="flag", forces_f64=ROWS.tobytes())
    assert read(Parameters, v1.Parameters(forces=[each])).forces == {"flag": [(0, 1, 2), (3, 4, 5)]}


def test_the_work_of_forces_and_the_new_words_are_read() -> None:
    told = read(Diagnostics, v1.Diagnostics(external_work=0.25))
    assert told.external_work == 0.25 and diagnostics_array([told])["external_work"].tolist() == [0.25]
    assert word(ENUMS["TimeBound"], v1.TIME_BOUND_MEDIUM) == "medium"
    assert read(Change, v1.StateChange(kind=v1.CHANGE_KIND_RESET, step=7)).kind == "reset"
