"""The contract as data: classes of messages and the methods of the service, made when the package is imported.

No generated stubs, which refuse to load with other versions of protobuf or grpcio than those that they were made with.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from nappe._wire._files import packed_bytes

# A message of the contract. Its class is made at run time, so that type checkers know nothing of its fields.
Message = Any

_PACKAGE = "nappe.v1"
_SERVICE = f"{_PACKAGE}.SimulationService"


@dataclass(frozen=True)
class Method:
    """A method of the service: how a call of it is named, packed and unpacked."""

    path: str
    request: Any
    answer: Any
    sends_stream: bool
    answers_stream: bool

    def on(self, channel: Any) -> Any:
        """What makes calls of the method on a channel of gRPC."""
        shape = f"{'stream' if self.sends_stream else 'unary'}_{'stream' if self.answers_stream else 'unary'}"
        return getattr(channel, shape)(
            self.path,
            request_serializer=self.request.SerializeToString,
            response_deserializer=self.answer.FromString,
        )


def _load() -> tuple[dict[str, Any], dict[str, Any], dict[str, Method]]:
    pool = descriptor_pool.DescriptorPool()
    files = descriptor_pb2.FileDescriptorSet.FromString(packed_bytes("contract.binpb"))
    for file in files.file:
        pool.AddSerializedFile(file.SerializeToString())
    messages: dict[str, Any] = {}
    enums: dict[str, Any] = {}
    for file in files.file:
        if file.package == _PACKAGE:
            described = pool.FindFileByName(file.name)
            for name, descriptor in described.message_types_by_name.items():
                messages[name] = message_factory.GetMessageClass(descriptor)
            enums.update(described.enum_types_by_name)
    methods = {}
    for method in pool.FindServiceByName(_SERVICE).methods:
        shape = descriptor_pb2.MethodDescriptorProto()
        method.CopyToProto(shape)
        methods[method.name] = Method(
            path=f"/{_SERVICE}/{method.name}",
            request=messages[method.input_type.name],
            answer=messages[method.output_type.name],
            sends_stream=shape.client_streaming,
            answers_stream=shape.server_streaming,
        )
    return messages, enums, methods


MESSAGES, ENUMS, METHODS = _load()


def number(enum: str, name: str) -> int:
    """The number of a value of an enum of the contract."""
    return int(ENUMS[enum].values_by_name[name].number)
