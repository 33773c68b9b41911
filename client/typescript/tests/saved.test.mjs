// Sessions as files, and sessions that outlive the real server: with the bits and the frames of those that nobody disturbed.

import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { load } from './bundle.mjs';
import { serve } from './server.mjs';

const { connect } = await load('src/index.ts');

test('a session that was saved goes on to the bit', async () => {
  const server = await serve();
  try {
    const client = connect(server.address, { token: server.token });
    const made = await client.create({ scene: 'flag', precision: 'f64', stepLimit: 0 });
    const before = await client.step(made, 7);
    const file = await client.save(made);
    for (const checkpoint of [file, new Blob([file])]) {
      const again = await client.create({ checkpoint });
      assert.deepEqual([again.step, again.stateHash], [7n, before.stateHash]);
      const stepped = await client.step(again, 9);
      const fork = await client.create({ checkpoint: await client.save(again) });
      assert.equal(fork.stateHash, stepped.stateHash);
      await client.delete(again);
      await client.delete(fork);
    }
    await assert.rejects(client.create({ checkpoint: file.subarray(1) }), { reason: 'INVALID_CHECKPOINT' });
    await assert.rejects(client.create({ checkpoint: file, scene: 'flag' }), { message: /one of scene, sceneText and checkpoint/ });
  } finally {
    await server.stop();
  }
});

test('who reads every frame goes on where the server was killed', async () => {
  const folder = mkdtempSync(join(tmpdir(), 'nappe-ts-kept-'));
  // The start is kept, and all since then is in the log: every frame is made again.
  const words = ['--state-dir', join(folder, 'states'), '--checkpoint-seconds', '3600'];
  let server = await serve({ words });
  try {
    const { address, token } = server;
    const client = connect(address, { token });
    const made = await client.create({ scene: 'flag', stepLimit: 0 });
    await client.play(made, { realTimeFactor: 1 });
    const numbers = [];
    for await (const frame of client.frames(made, { every: true, from: 0 })) {
      numbers.push(Number(frame.frame));
      frame.release();
      if (numbers.length % 10 === 0 && numbers.length < 40) {
        await server.stop();
        server = await serve({ address, token, words });
      }
      if (numbers.length === 50) break;
    }
    assert.deepEqual(numbers, Array.from({ length: 50 }, (_, number) => number));
  } finally {
    await server.stop();
    rmSync(folder, { recursive: true, force: true });
  }
});
