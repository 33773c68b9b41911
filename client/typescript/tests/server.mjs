// The real server, for tests: started on a free port of loopback with a token, and ended with the test.

import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { createInterface } from 'node:readline';

const ROOT = new URL('../../../', import.meta.url).pathname;
const BUILT = resolve(ROOT, process.env.CARGO_TARGET_DIR ?? 'target', 'release');

/** The program of `NAPPE_SERVER_PROGRAM`, or the one that was built. */
function program() {
  const found = process.env.NAPPE_SERVER_PROGRAM ?? join(BUILT, 'nappe-server');
  if (!existsSync(found)) throw new Error('nappe-server is not built: cargo build --release, or name it in NAPPE_SERVER_PROGRAM');
  return found;
}

/** An example of the client in Rust that was built; null where it was not. */
export function example(name) {
  const found = join(process.env.CARGO_TARGET_DIR ? BUILT : join(program(), '..'), 'examples', name);
  return existsSync(found) ? found : null;
}

/** Starts a server, at an address and with further arguments; `stop` waits until it has ended. */
export async function serve({ address = '127.0.0.1:0', token = '0123456789abcdef'.repeat(2), words = [] } = {}) {
  const folder = mkdtempSync(join(tmpdir(), 'nappe-ts-'));
  const tokenFile = join(folder, 'token');
  writeFileSync(tokenFile, `${token}\n`, { mode: 0o600 });
  const child = spawn(program(), ['--address', address, '--token', tokenFile, '--until-stdin-closes', '--log', 'error', ...words], {
    stdio: ['pipe', 'pipe', 'inherit'],
  });
  const ended = new Promise((end) => child.once('exit', end));
  const line = await new Promise((found, failed) => {
    createInterface({ input: child.stdout }).once('line', found);
    child.once('exit', (code) => failed(new Error(`the server ended with ${code}`)));
  });
  const [, listens] = /http:\/\/(\S+)/.exec(line) ?? [];
  // A test that failed before it stopped its server does not keep Node from ending, which ends the server.
  for (const held of [child, child.stdin, child.stdout]) held.unref();
  const stop = async (signal = 'SIGKILL') => {
    child.ref();
    child.kill(signal);
    await ended;
    rmSync(folder, { recursive: true, force: true });
  };
  return { address: listens, port: Number(listens.split(':').pop()), token, tokenFile, stop };
}

/** Waits until something holds, and returns how long that took (s). */
export async function eventually(holds, seconds = 60) {
  const begin = performance.now();
  while (!(await holds())) {
    if (performance.now() - begin > 1000 * seconds) throw new Error(`it does not come to hold: ${holds}`);
    await new Promise((passed) => setTimeout(passed, 5));
  }
  return (performance.now() - begin) / 1000;
}
