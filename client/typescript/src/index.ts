// The client of nappe for browsers and Node: `connect` gives a `Client`.

export { Client, connect, type Created } from './client.ts';
export type { Given, Whole } from './checks.ts';
export { meshOf, type Mesh } from './colliders.ts';
export { Code, failureError, NappeError, type Reason } from './errors.ts';
export type { Numbers } from './arrays.ts';
export { forcesOf, type CalledForces } from './forces.ts';
export type { FieldName, LiveFrame } from './frame.ts';
export type {
  Changes, CreateOptions, ForkOptions, LinkOptions, PauseOptions, PlayOptions, PrecisionName, SessionRef, StepOptions, UpdateOptions,
} from './requests.ts';
export type { FrameOptions, StreamOptions } from './streams.ts';
export type { Pose } from './poses.ts';
export type { ConnectOptions } from './target.ts';
export type { MeshFile, MeshFormat, Uploaded } from './uploads.ts';
export type { Body, Topology } from './topology.ts';
export type { Carried, ColliderShape, Diagnostics, MeshShape, Vector3 } from './gen/nappe/v1/frame_pb.ts';
export {
  ChangeKind, SessionState, type Failure, type GetServerInfoResponse, type Limits, type MakeLinkResponse, type Parameters, type Progress, type Session,
  type SessionEnd, type StateChange, type UpdateParametersResponse,
} from './gen/nappe/v1/simulation_pb.ts';
