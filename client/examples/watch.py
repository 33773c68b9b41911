"""Creates the demo on a running server, plays it, prints each frame. See docs/service.md."""

import sys

import grpc
import numpy
from nappe.v1 import frame_pb2, simulation_pb2, simulation_pb2_grpc
from nappe_token import token


def positions(frame):
    """Positions in one piece of a frame (m): an array of n x 3, without a copy."""
    for field in frame.fields:
        if field.field == frame_pb2.FIELD_POSITIONS:
            return field.first_particle, numpy.frombuffer(field.data, "<f4").reshape(-1, 3)
    return 0, numpy.zeros((0, 3), "<f4")


def main(server):
    shown = token(server)
    with grpc.insecure_channel(server) as channel:
        service = simulation_pb2_grpc.SimulationServiceStub(channel)
        request = simulation_pb2.CreateSessionRequest(scene_name="demo", step_limit=40)
        session = service.CreateSession(request, metadata=shown).session
        watch = simulation_pb2.WatchFramesRequest(
            session_id=session.session_id, delivery=simulation_pb2.DELIVERY_EVERY, from_frame=0
        )
        events = service.WatchFrames(watch, metadata=shown)
        play = simulation_pb2.PlaySessionRequest(session_id=session.session_id)
        service.PlaySession(play, metadata=shown)
        for event in events:
            if event.HasField("topology") and event.topology.chunk.index == 0:
                count = event.topology.particle_count
                x = numpy.zeros((count, 3), "<f4")
                print(f"{count} particles")
            elif event.HasField("frame"):
                first, piece = positions(event.frame)
                x[first : first + len(piece)] = piece
                if event.frame.chunk.index + 1 == event.frame.chunk.count:
                    print(f"{event.frame.time_seconds:8.4f} s  lowest particle at {x[:, 1].min():.4f} m")
            elif event.HasField("end"):
                print(f"{event.end.step} steps, state {event.end.state_hash:016x}")
        delete = simulation_pb2.DeleteSessionRequest(session_id=session.session_id)
        service.DeleteSession(delete, metadata=shown)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:6277")
