// The file of a session on its way here, in pieces.
//
// Enters: a session. Leaves: the bytes of its file, from which `create` goes on.

import { create, toBinary } from '@bufbuild/protobuf';
import { broken } from './errors.ts';
import { SaveSessionRequestSchema, SimulationService } from './gen/nappe/v1/simulation_pb.ts';
import { Answer, decoded, type Target } from './grpcweb.ts';
import { named, type SessionRef } from './requests.ts';

/** The file of a session, as it stands between two steps. */
export async function savedFile(
  target: Target, session: SessionRef, signal: AbortSignal | undefined,
): Promise<Uint8Array<ArrayBuffer>> {
  const { saveSession } = SimulationService.method;
  const request = toBinary(saveSession.input, create(SaveSessionRequestSchema, named(session)));
  // A step in progress may take long, and nothing comes meanwhile.
  const answer = await Answer.begin(target, saveSession, request, { signal }, null);
  try {
    let file = new Uint8Array(0);
    let at = 0;
    for (let bytes = await answer.next(); bytes !== null; bytes = await answer.next()) {
      const { data, byteCount } = decoded(saveSession.output, bytes);
      if (at === 0) file = new Uint8Array(Number(byteCount));
      if (at + data.length > file.length) throw broken(`more than ${file.length} bytes came of the file of a session`);
      file.set(data, at);
      at += data.length;
    }
    if (at === 0 || at < file.length) throw broken(`${at} of ${file.length} bytes came of the file of a session`);
    return file;
  } finally {
    answer.close();
  }
}
