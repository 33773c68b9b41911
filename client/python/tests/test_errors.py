"""Every reason of the contract as a server sends it, and the exception that it becomes."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import grpc
import pytest
from google.protobuf.any_pb2 import Any as Packed
from google.rpc import error_details_pb2, status_pb2

import nappe
from nappe._wire._errors import from_call, from_status, of_failure, refused

ROWS: list[dict[str, Any]] = json.loads(
    (Path(__file__).parents[3] / "proto/nappe/v1/reasons.json").read_text(encoding="utf-8")
)

# From docs/errors.md: what a program that catches by class relies on.
BY_CODE: dict[str, type[nappe.Error]] = {
    "INVALID_ARGUMENT": nappe.Refused,
    "NOT_FOUND": nappe.NotFound,
    "RESOURCE_EXHAUSTED": nappe.Full,
    "UNAUTHENTICATED": nappe.Unauthenticated,
    "UNAVAILABLE": nappe.Unavailable,
    "ABORTED": nappe.Error,
    "ALREADY_EXISTS": nappe.Error,
    "CANCELLED": nappe.Error,
    "DEADLINE_EXCEEDED": nappe.Error,
    "FAILED_PRECONDITION": nappe.Error,
    "INTERNAL": nappe.Error,
    "OUT_OF_RANGE": nappe.Error,
    "PERMISSION_DENIED": nappe.Error,
    "UNIMPLEMENTED": nappe.Error,
}
DIVERGENCE = [
    "NOT_FINITE",
    "STRETCH_LIMIT",
    "ENERGY_LIMIT",
    "SOLVER_FAILED",
    "TIME_STEP_LIMIT",
    "SUBSTEP_LIMIT",
    "POTENTIAL_DESCENT",
    "ENERGY_GAIN",
    "MOMENTUM_BALANCE",
    "STEP_ACCURACY",
    "ERROR_TOLERANCE",
    "COLLIDER_PASSED",
    "CONTACT",
    "NEVER_STABLE",
    "NODE_SPEED",
    "DEFORMATION_LIMIT",
    "OUT_OF_RANGE",
    "GRID_MEMORY",
    "MASS_LOST",
]
BY_REASON: dict[str, type[nappe.Error]] = {
    **dict.fromkeys(DIVERGENCE, nappe.Diverged),
    "FRAME_EXPIRED": nappe.Expired,
    "WATCHER_TOO_SLOW": nappe.TooSlow,
    "WATCHER_STALLED": nappe.TooSlow,
}
CLASSES = [
    nappe.Unavailable,
    nappe.NotFound,
    nappe.Refused,
    nappe.Diverged,
    nappe.TooSlow,
    nappe.Expired,
    nappe.Full,
    nappe.Unauthenticated,
    nappe.Closed,
]


def packed(*details: Any) -> bytes:
    """What stands in `grpc-status-details-bin`."""
    status = status_pb2.Status(code=3, message="what happened")
    for detail in details:
        status.details.add().Pack(detail)
    return bytes(status.SerializeToString())


def info(reason: str, **metadata: str) -> Any:
    return error_details_pb2.ErrorInfo(reason=reason, domain="nappe.v1", metadata=metadata)


def error_of(
    code: str, message: str = "what happened", details: bytes | None = None, limit: float | None = None
) -> Any:
    return from_status(code, message, details, "127.0.0.1:6277", "StepSession", limit)


def of_reason(reason: str, code: str, **metadata: str) -> Any:
    return error_of(code, details=packed(info(reason, **metadata)))


class Ended:
    """A call of gRPC that failed, as far as it is read."""

    def __init__(self, code: grpc.StatusCode, details: str | None, trailing: Any) -> None:
        self._code, self._details, self._trailing = code, details, trailing

    def code(self) -> grpc.StatusCode:
        return self._code

    def details(self) -> str | None:
        return self._details

    def trailing_metadata(self) -> Any:
        return self._trailing


@pytest.mark.parametrize("row", ROWS, ids=[row["reason"] for row in ROWS])
def test_a_status_of_every_reason_becomes_its_class_and_keeps_what_it_says(row: dict[str, Any]) -> None:
    reason, code = row["reason"], row["code"]
    error = of_reason(reason, code, step="12", value="1e9")
    assert type(error) is BY_REASON.get(reason, BY_CODE[code])
    assert (error.reason, error.code, error.message) == (reason, code, "what happened")
    assert error.metadata == {"step": "12", "value": "1e9"}
    assert error.remedy == row["remedy"]
    assert str(error) == f"what happened ({reason})\n{row['remedy']}"
    assert error.is_transient is (code in ("UNAVAILABLE", "DEADLINE_EXCEEDED"))


@pytest.mark.parametrize("row", ROWS, ids=[row["reason"] for row in ROWS])
def test_a_session_that_failed_for_a_reason_is_the_same_error_as_a_call(row: dict[str, Any]) -> None:
    error = of_failure(nappe.v1.Failure(reason=row["reason"], message="what happened", step=12))
    assert type(error) is type(of_reason(row["reason"], row["code"]))
    assert (error.reason, error.code, error.remedy) == (row["reason"], row["code"], row["remedy"])


def test_the_table_of_the_package_is_that_of_the_contract() -> None:
    assert set(nappe.REASONS) == {row["reason"] for row in ROWS}
    for row in ROWS:
        assert vars(nappe.REASONS[row["reason"]]) == row
    assert {row["reason"] for row in ROWS if row["is_divergence"]} == set(DIVERGENCE)
    assert len({row["reason"] for row in ROWS}) == len(ROWS)


@pytest.mark.parametrize("kind", CLASSES, ids=[kind.__name__ for kind in CLASSES])
def test_every_class_is_an_error_of_nappe_and_none_is_another_one(kind: type[nappe.Error]) -> None:
    assert kind.__bases__ == (nappe.Error,) and issubclass(nappe.Error, Exception)


def test_a_reason_of_a_newer_server_is_told_by_its_code_and_has_no_remedy() -> None:
    error = of_reason("QUEUE_FULL", "RESOURCE_EXHAUSTED", allowed="3")
    assert type(error) is nappe.Full
    assert (error.reason, error.metadata, error.remedy) == ("QUEUE_FULL", {"allowed": "3"}, None)
    assert str(error) == "what happened (QUEUE_FULL)"


def test_other_details_beside_the_reason_do_not_hide_it() -> None:
    fields = error_details_pb2.BadRequest()
    fields.field_violations.add(field="world.dt", description="is negative")
    error = error_of("INVALID_ARGUMENT", details=packed(fields, info("INVALID_FIELD", field="world.dt")))
    assert (error.reason, error.metadata) == ("INVALID_FIELD", {"field": "world.dt"})


def test_no_answer_names_the_address_and_what_to_do() -> None:
    error = error_of("UNAVAILABLE", "connection refused")
    assert type(error) is nappe.Unavailable and error.is_transient
    assert (error.reason, error.code) == (None, "UNAVAILABLE")
    assert "127.0.0.1:6277" in error.message and "connection refused" in error.message
    assert error.remedy is not None and "nappe.serve()" in error.remedy and str(error).endswith(error.remedy)


def test_a_server_that_drains_is_not_taken_for_one_that_is_not_there() -> None:
    error = of_reason("SERVER_DRAINING", "UNAVAILABLE")
    assert type(error) is nappe.Unavailable and error.message == "what happened"


def test_a_call_that_took_too_long_says_which_and_how_long() -> None:
    error = error_of("DEADLINE_EXCEEDED", "Deadline Exceeded", limit=2.5)
    assert type(error) is nappe.Error and error.is_transient and error.code == "DEADLINE_EXCEEDED"
    assert error.message == "127.0.0.1:6277 did not answer StepSession within 2.5 s"
    without = error_of("DEADLINE_EXCEEDED", "Deadline Exceeded")
    assert without.message == "Deadline Exceeded" and without.is_transient


def test_a_server_that_knows_no_such_method_is_told_apart_from_one_of_nappe() -> None:
    foreign = error_of("UNIMPLEMENTED", "unknown service")
    assert type(foreign) is nappe.Error and foreign.code == "UNIMPLEMENTED" and not foreign.is_transient
    assert "127.0.0.1:6277" in foreign.message and "unknown service" in foreign.message
    assert "StepSession" in error_of("UNIMPLEMENTED", "").message
    assert of_reason("UNKNOWN_METHOD", "UNIMPLEMENTED").message == "what happened"


@pytest.mark.parametrize(
    ("code", "kind"),
    [("UNKNOWN", nappe.Error), ("NOT_FOUND", nappe.NotFound), ("UNAUTHENTICATED", nappe.Unauthenticated)],
)
def test_a_status_without_details_keeps_its_message_and_its_code(code: str, kind: type[nappe.Error]) -> None:
    error = error_of(code, "Exception calling application")
    assert type(error) is kind and (error.reason, error.code, error.remedy) == (None, code, None)
    assert str(error) == "Exception calling application" and error.metadata == {} and not error.is_transient
    assert str(error_of(code, "")) == code


def garbage() -> dict[str, bytes]:
    whole = packed(info("NOT_FINITE", step="12"))
    status = status_pb2.Status(code=3)
    status.details.append(Packed(type_url="type.googleapis.com/google.rpc.ErrorInfo", value=b"\xff\xff"))
    elsewhere = status_pb2.Status(code=3)
    elsewhere.details.append(Packed(type_url="type.googleapis.com/acme.Oops", value=b"\x01\x02"))
    return {
        "none": b"",
        "no status": b"\xff\xff\xff",
        "cut": whole[: len(whole) - 3],
        "no info in its place": status.SerializeToString(),
        "another's details": elsewhere.SerializeToString(),
        "a status alone": packed(),
    }


@pytest.mark.parametrize("what", garbage())
def test_details_that_cannot_be_read_leave_code_and_message(what: str) -> None:
    error = error_of("INVALID_ARGUMENT", details=garbage()[what])
    assert type(error) is nappe.Refused and (error.reason, error.metadata) == (None, {})
    assert (error.message, error.code) == ("what happened", "INVALID_ARGUMENT")


def test_a_call_of_grpc_is_read_with_its_trailers() -> None:
    trailing = (("server", "nappe"), ("grpc-status-details-bin", packed(info("SESSION_NOT_FOUND", id="flag"))))
    error = from_call(Ended(grpc.StatusCode.NOT_FOUND, "no such session", trailing), "a:1", "GetSession", 10.0)
    assert type(error) is nappe.NotFound and error.metadata == {"id": "flag"}
    assert str(error).startswith("no such session (SESSION_NOT_FOUND)\n")
    bare = from_call(Ended(grpc.StatusCode.UNAVAILABLE, None, None), "a:1", "GetSession", 10.0)
    assert type(bare) is nappe.Unavailable and "a:1" in bare.message
    late = from_call(Ended(grpc.StatusCode.DEADLINE_EXCEEDED, "", ()), "a:1", "GetSession", 10.0)
    assert late.message == "a:1 did not answer GetSession within 10 s"


def test_a_refusal_says_where_in_a_file() -> None:
    error = of_reason("INVALID_SCENE", "INVALID_ARGUMENT", line="3", column="17", field="world.dt")
    assert (error.line, error.column, error.field) == (3, 17, "world.dt")
    bare = of_reason("INVALID_CHANGE", "INVALID_ARGUMENT")
    assert (bare.line, bare.column, bare.field) == (None, None, None)


def test_a_divergence_says_when_and_which_particle() -> None:
    error = of_reason("STRETCH_LIMIT", "FAILED_PRECONDITION", step="0", particle="16777215")
    assert (error.step, error.particle, error.cause) == (0, 16777215, "what happened")
    bare = of_reason("MASS_LOST", "FAILED_PRECONDITION")
    assert (bare.step, bare.particle) == (None, None)


def test_an_expired_frame_comes_with_the_oldest_that_is_kept() -> None:
    assert of_reason("FRAME_EXPIRED", "OUT_OF_RANGE", oldest_frame="412").oldest_frame == 412
    assert of_reason("FRAME_EXPIRED", "OUT_OF_RANGE").oldest_frame is None


@pytest.mark.parametrize("text", ["", "-", "x", "1.5", "--5", "5-", "²", " "])
def test_a_number_that_is_none_is_absent_rather_than_another_error(text: str) -> None:
    assert of_reason("FRAME_EXPIRED", "OUT_OF_RANGE", oldest_frame=text).oldest_frame is None
    assert of_reason("INVALID_MESH", "INVALID_ARGUMENT", line=text).line is None


def test_a_failure_of_a_session_keeps_its_numbers() -> None:
    told = {"message": "a velocity of particle 5 is not finite", "step": 12, "time_seconds": 0.125}
    failure = nappe.v1.Failure(reason="NOT_FINITE", particle=5, value=float("inf"), **told)
    error = of_failure(failure)
    assert isinstance(error, nappe.Diverged)
    assert (error.step, error.particle, error.cause) == (12, 5, told["message"])
    assert error.metadata == {"step": "12", "time_seconds": "0.125", "particle": "5", "value": "inf"}
    assert str(error) == f"{told['message']} (NOT_FINITE)\n{nappe.REASONS['NOT_FINITE'].remedy}"


def test_a_failure_without_particle_and_value_invents_none() -> None:
    error = of_failure(nappe.v1.Failure(reason="MASS_LOST", message="particles were lost", step=3))
    assert isinstance(error, nappe.Diverged) and (error.step, error.particle) == (3, None)
    assert set(error.metadata) == {"step", "time_seconds"}
    zero = of_failure(nappe.v1.Failure(reason="NOT_FINITE", particle=0, value=0.0))
    assert isinstance(zero, nappe.Diverged) and zero.particle == 0 and zero.metadata["value"] == "0.0"


def test_a_failure_of_a_newer_server_is_an_error_without_a_code() -> None:
    error = of_failure(nappe.v1.Failure(reason="TORN", message="the cloth tore", step=3))
    assert type(error) is nappe.Error and (error.reason, error.code, error.remedy) == ("TORN", None, None)
    assert str(error) == "the cloth tore (TORN)" and error.metadata["step"] == "3"


def test_what_the_package_refuses_by_itself_names_the_argument_and_no_reason() -> None:
    error = refused("fields names no array", "fields")
    assert type(error) is nappe.Refused and (error.field, error.reason, error.code) == ("fields", None, None)
    assert str(error) == "fields names no array" and not error.is_transient


def test_a_remedy_of_ones_own_stands_in_place_of_that_of_the_table() -> None:
    error = nappe.Error("no", reason="INTERNAL", remedy="Ask Anna.")
    assert error.remedy == "Ask Anna." and str(error) == "no (INTERNAL)\nAsk Anna."


def test_metadata_belongs_to_the_error_alone() -> None:
    given = {"step": "1"}
    error = nappe.Diverged("gone", metadata=given)
    given["step"] = "2"
    assert error.step == 1


def test_an_error_goes_from_process_to_process() -> None:
    error = of_reason("INVALID_SCENE", "INVALID_ARGUMENT", line="3")
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is nappe.Refused and str(again) == str(error) and again.line == 3
