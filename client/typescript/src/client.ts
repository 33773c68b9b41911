// A server, with its sessions: calls with one answer, and streams.
//
// Enters: an address and a token. Leaves: answers of the contract.

import { create, type DescMessage, type MessageShape } from '@bufbuild/protobuf';
import { beginFault, readBegun, sendBegun } from './begun.ts';
import { checkSignal, text, type Whole } from './checks.ts';
import { broken } from './errors.ts';
import {
  AppendUploadRequestSchema, BeginUploadRequestSchema, DeleteSessionRequestSchema, FinishUploadRequestSchema, GetServerInfoRequestSchema,
  GetSessionRequestSchema, ListSessionsRequestSchema, MakeLinkRequestSchema, OpenLinkRequestSchema, SimulationService, type GetServerInfoResponse, type MakeLinkResponse, type Session, type UpdateParametersResponse,
} from './gen/nappe/v1/simulation_pb.ts';
import { call, type Method, type Target } from './grpcweb.ts';
import {
  createRequest, forkRequest, linkRequest, named, pauseRequest, playRequest, stepRequest, updateRequest,
  type CreateOptions, type ForkOptions, type LinkOptions, type PauseOptions, type PlayOptions, type SessionRef, type StepOptions, type UpdateOptions,
} from './requests.ts';
import { diagnostics, frames, topology, type FrameOptions, type StreamOptions } from './streams.ts';
import { readTarget, readToken, type ConnectOptions } from './target.ts';
import { savedFile } from './saved.ts';
import { checkpointUpload, fileUpload, pieces, type MeshFile, type Uploaded } from './uploads.ts';
import { writable } from './written.ts';
import type { LiveFrame } from './frame.ts';
import type { Diagnostics } from './gen/nappe/v1/frame_pb.ts';
import type { Topology } from './topology.ts';

/** Longest time of a call that the server answers at once (s). */
const CALL_SECONDS = 10;
/** Longest time that the building of a large scene may take (s). */
const CREATE_SECONDS = 120;
/** Longest time of one piece of an upload (s): the server gives up before, where the rate of bytes is too low. */
const PIECE_SECONDS = 120;
/** Sessions in a page of the list. */
const PAGE_SIZE = 200;

const { method: METHODS } = SimulationService;

/** A new session, and what is odd about its scene but does not stop a simulation. */
export type Created = Session & { warnings: string[] };

/** A client of the server at an address: `HOST:PORT`, `http://...`, or relative to the page, such as `.`. Sends nothing yet. */
export function connect(url: string, options: ConnectOptions = {}): Client {
  return new Client(readTarget(url, options));
}

/** A server, with its sessions. */
export class Client {
  readonly #target: Target;

  constructor(target: Target) {
    this.#target = target;
  }

  /** Where calls go. */
  get address(): string {
    return this.#target.address;
  }

  /** What the server is shown from now on. */
  setToken(token: string | null): void {
    this.#target.token = readToken(token);
  }

  /** Version, limits and shipped scenes of the server. */
  info(signal?: AbortSignal): Promise<GetServerInfoResponse> {
    return this.#call(METHODS.getServerInfo, create(GetServerInfoRequestSchema), signal, CALL_SECONDS);
  }

  /** Names of the scenes that the server ships. */
  async shippedScenes(signal?: AbortSignal): Promise<string[]> {
    return (await this.info(signal)).scenes;
  }

  /** A code that is good for the token once, and for how long. It stands behind the address of the server's page, after a `#`. */
  makeLink(signal?: AbortSignal): Promise<MakeLinkResponse> {
    return this.#call(METHODS.makeLink, create(MakeLinkRequestSchema), signal, CALL_SECONDS);
  }

  /** A code for a link to one session: each who opens it may watch that session and work with copies of it, and there is no other for him. */
  async makeSessionLink(session: SessionRef, options: LinkOptions = {}, signal?: AbortSignal): Promise<MakeLinkResponse> {
    return this.#call(METHODS.makeLink, linkRequest(session, options), signal, CALL_SECONDS);
  }

  /** The token for a code, which is good for it as often as its link can be opened; empty if the server asks for none. */
  async openLink(code: string, signal?: AbortSignal): Promise<string> {
    const request = create(OpenLinkRequestSchema, { code: text(code, 'code') });
    return (await this.#call(METHODS.openLink, request, signal, CALL_SECONDS)).token;
  }

  /** All sessions, in the order of their ids. */
  async list(signal?: AbortSignal): Promise<Session[]> {
    const found: Session[] = [];
    let pageToken = '';
    for (;;) {
      const request = create(ListSessionsRequestSchema, { pageSize: PAGE_SIZE, pageToken });
      const page = await this.#call(METHODS.listSessions, request, signal, CALL_SECONDS);
      found.push(...page.sessions.map((session) => writable(session)));
      pageToken = page.nextPageToken;
      // A page that holds nothing and promises more would never end.
      if (pageToken === '' || page.sessions.length === 0) return found;
    }
  }

  /** How a session stands. */
  async get(session: SessionRef, signal?: AbortSignal): Promise<Session> {
    const request = create(GetSessionRequestSchema, named(session));
    return present(await this.#call(METHODS.getSession, request, signal, CALL_SECONDS));
  }

  /** Sends a mesh file as it is, which the server reads and checks; a scene names the mesh by its id. */
  async uploadFile(file: MeshFile, signal?: AbortSignal): Promise<Uploaded> {
    const { header, bytes } = fileUpload(file);
    return this.#upload(header, bytes, signal);
  }

  async #upload(header: ReturnType<typeof fileUpload>['header'], bytes: Blob, signal: AbortSignal | undefined): Promise<Uploaded> {
    const begin = create(BeginUploadRequestSchema, { header: { case: 'file', value: header } });
    const { uploadId } = await this.#call(METHODS.beginUpload, begin, signal, CALL_SECONDS);
    for await (const piece of pieces(bytes)) {
      await this.#call(METHODS.appendUpload, create(AppendUploadRequestSchema, { uploadId, ...piece }), signal, PIECE_SECONDS);
    }
    const finish = create(FinishUploadRequestSchema, { uploadId });
    const { meshId, warnings } = await this.#call(METHODS.finishUpload, finish, signal, CREATE_SECONDS);
    return { meshId, warnings };
  }

  /** Makes a session, paused before its first step. */
  async create(options: CreateOptions, signal?: AbortSignal): Promise<Created> {
    checkSignal(signal);
    const request = createRequest(options);
    if (options.checkpoint !== undefined) {
      const { header, bytes } = checkpointUpload(options.checkpoint);
      request.scene = { case: 'checkpointId', value: (await this.#upload(header, bytes, signal)).meshId };
    }
    const begun = options.begin === undefined ? null : readBegun(options.begin);
    if (begun !== null) request.begin = await sendBegun(this.#target, begun, signal);
    const answer = await this.#call(METHODS.createSession, request, signal, CREATE_SECONDS);
    const made = Object.assign(present(answer), { warnings: answer.warnings });
    const fault = begun === null ? null : beginFault(begun, made);
    if (fault === null) return made;
    await this.delete(made, signal);
    throw fault;
  }

  /** Steps on, at so many simulated seconds per second of wall clock; 0: as fast as possible. */
  async play(session: SessionRef, options: PlayOptions = {}, signal?: AbortSignal): Promise<Session> {
    return present(await this.#call(METHODS.playSession, playRequest(session, options), signal));
  }

  /** Stops stepping after the step in progress; answers once the session stands, unless `wait` is false. */
  async pause(session: SessionRef, options: PauseOptions = {}, signal?: AbortSignal): Promise<Session> {
    return present(await this.#call(METHODS.pauseSession, pauseRequest(session, options), signal));
  }

  /** Takes so many steps, then pauses. */
  async step(session: SessionRef, count: Whole = 1, options: StepOptions = {}, signal?: AbortSignal): Promise<Session> {
    return present(await this.#call(METHODS.stepSession, stepRequest(session, count, options), signal));
  }

  /** Changes parameters between two steps, all of them or none. */
  async update(session: SessionRef, options: UpdateOptions, signal?: AbortSignal): Promise<UpdateParametersResponse> {
    return this.#call(METHODS.updateParameters, updateRequest(session, options), signal);
  }

  /** Makes a session that stands where this one stands, to the bit, paused. */
  async fork(session: SessionRef, options: ForkOptions = {}, signal?: AbortSignal): Promise<Session> {
    return present(await this.#call(METHODS.forkSession, forkRequest(session, options), signal));
  }

  /** The file of a session, as it stands between two steps; it goes on. `create({ checkpoint })` goes on from there, to the bit. */
  async save(session: SessionRef, signal?: AbortSignal): Promise<Uint8Array<ArrayBuffer>> {
    checkSignal(signal);
    return savedFile(this.#target, session, signal);
  }

  /** Ends a session and forgets it. */
  async delete(session: SessionRef, signal?: AbortSignal): Promise<void> {
    await this.#call(METHODS.deleteSession, create(DeleteSessionRequestSchema, named(session)), signal);
  }

  /** What a session is made of. */
  topology(session: SessionRef, signal?: AbortSignal): Promise<Topology> {
    return topology(this.#target, session, signal);
  }

  /** Frames as they are made, until the session ends. Leaving the loop ends the stream on the server too. */
  frames(session: SessionRef, options: FrameOptions = {}): AsyncIterableIterator<LiveFrame> {
    return frames(this.#target, session, options);
  }

  /** Diagnostics of frames as they are made, without particles, by the same rules. */
  diagnostics(session: SessionRef, options: StreamOptions = {}): AsyncIterableIterator<Diagnostics> {
    return diagnostics(this.#target, session, options);
  }

  async #call<I extends DescMessage, O extends DescMessage>(
    method: Method<I, O>, message: MessageShape<I>, signal: AbortSignal | undefined, seconds?: number,
  ): Promise<MessageShape<O>> {
    checkSignal(signal);
    return writable(await call(this.#target, method, message, { signal, seconds }));
  }
}

/** The session in an answer, which the contract promises. */
function present({ session, $typeName }: { session?: Session | undefined; $typeName: string }): Session {
  if (session === undefined) throw broken(`${$typeName} lacks its session`);
  return writable(session);
}
