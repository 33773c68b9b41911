// Measures the package on this machine: throughput, and how soon streams that are left are gone.
// `node tools/measure.mjs`, with the server of NAPPE_SERVER_PROGRAM or the one that was built.

import { load } from '../tests/bundle.mjs';
import { eventually, serve } from '../tests/server.mjs';

const CLOTH = `version = 1
title = "A large cloth"
dt = 1e-5
[[body]]
name = "cloth"
mesh = { grid = [316, 316], spacing = 0.01 }
mass = { density = 0.15 }
integrator = "symplectic_euler"
[body.springs]
stretch = { stiffness = 1, damping = 0 }
shear = { stiffness = 1, damping = 0 }
bend = { stiffness = 0, damping = 0 }
`;
// Only frames that are already made are read, so that the physics does not matter, and the steps do not count.
const [FRAMES, PASSES] = [50, 20];

const { connect } = await load('src/index.ts');
const server = await serve();
const client = connect(server.address, { token: server.token });

async function throughput() {
  const session = await client.create({ sceneText: CLOTH, frameIntervalSteps: 1 });
  await client.step(session, FRAMES);
  let bytes = 0;
  const begin = performance.now();
  for (let pass = 0; pass < PASSES; pass++) {
    for await (const frame of client.frames(session, { every: true, from: 0n })) {
      bytes += frame.positions.byteLength;
      frame.release();
      if (frame.frame === BigInt(FRAMES)) break;
    }
  }
  const seconds = (performance.now() - begin) / 1000;
  console.log(`${session.particleCount} particles, raw f32, loopback: ${(bytes / seconds / 1e6).toFixed(0)} MB/s`);
  await client.delete(session);
}

async function leaving() {
  const session = await client.create({ scene: 'demo', stepLimit: 0n });
  await client.play(session);
  await Promise.all(Array.from({ length: 20 }, () => leave(session)));
  const seconds = await eventually(async () => (await client.get(session)).watcherCount === 0);
  console.log(`20 streams that are left at once leave no watcher after ${(1000 * seconds).toFixed(0)} ms`);
  await client.delete(session);
}

async function leave(session) {
  for await (const frame of client.frames(session)) return frame.release();
}

await throughput();
await leaving();
await server.stop();
