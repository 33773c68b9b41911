// A real server, the page in a browser without a screen, and a line between them that can be cut.
//
// The page is the one that the server serves; `--page FILE` puts another one in its place.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { createServer, request } from 'node:http';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { Transform } from 'node:stream';
import { load } from '../bundle.mjs';
import { blind, emptyWindow } from '../chromium.mjs';

const { connect } = await load('../../client/typescript/src/index.ts');

export const TOKEN = '0123456789abcdef'.repeat(2);
/** What is seen within so long (ms) is seen at all. */
const PATIENCE = 30_000;

export const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Waits until something holds, and returns how long that took (ms). */
export async function eventually(holds, what, ms = PATIENCE) {
  const begin = performance.now();
  while (!(await holds())) {
    assert.ok(performance.now() - begin < ms, `within ${ms} ms: ${what}`);
    await sleep(10);
  }
  return performance.now() - begin;
}

/** Starts a server at a port, 0 for a free one; with a token unless `token` is null. */
export async function serve(program, { port = 0, token = TOKEN } = {}) {
  const folder = await mkdtemp(join(tmpdir(), 'nappe-live-'));
  const file = join(folder, 'token');
  await writeFile(file, `${token}\n`, { mode: 0o600 });
  const words = token === null ? ['--no-token'] : ['--token', file];
  const child = spawn(program, ['--address', `127.0.0.1:${port}`, ...words, '--until-stdin-closes', '--log', 'error'], { stdio: ['pipe', 'pipe', 'inherit'] });
  const ended = new Promise((resolve) => child.once('exit', resolve));
  const line = await new Promise((resolve, reject) => {
    createInterface({ input: child.stdout }).once('line', resolve);
    child.once('exit', (code) => reject(new Error(`the server ended with ${code}`)));
  });
  const address = /http:\/\/(\S+)/.exec(line)[1];
  return {
    port: Number(address.split(':').pop()), client: connect(address, { token }), pid: child.pid, signal: (name) => child.kill(name),
    stop: async (name = 'SIGKILL') => {
      child.kill(name);
      await ended;
      await rm(folder, { recursive: true, force: true });
    },
  };
}

/** Passes on so many bytes per second. */
const slowly = (rate) => new Transform({
  transform: (chunk, _, passed) => void setTimeout(() => passed(null, chunk), (1e3 * chunk.length) / rate),
});

/** Carries requests to the server at a port, each with so many bytes per second; all connections can be cut. */
export async function lineTo(port, pageFile, rate = Infinity) {
  const sockets = new Set();
  const line = createServer((asked, answer) => {
    if (pageFile !== undefined && asked.method === 'GET' && new URL(asked.url, 'http://page').pathname === '/') {
      readFile(pageFile).then((page) => answer.writeHead(200, { 'content-type': 'text/html; charset=utf-8' }).end(page));
      return;
    }
    const passed = request({ host: '127.0.0.1', port, path: asked.url, method: asked.method, headers: asked.headers });
    passed.on('response', (given) => {
      answer.writeHead(given.statusCode, given.headers);
      (rate === Infinity ? given : given.pipe(slowly(rate))).pipe(answer);
      given.on('error', () => answer.destroy());
    });
    passed.on('error', () => answer.destroy());
    answer.on('close', () => passed.destroy());
    asked.pipe(passed);
  });
  line.on('connection', (socket) => {
    sockets.add(socket);
    socket.on('close', () => sockets.delete(socket));
  });
  await new Promise((resolve) => line.listen(0, '127.0.0.1', resolve));
  const cut = () => sockets.forEach((socket) => socket.destroy());
  return { address: `http://127.0.0.1:${line.address().port}/`, cut, close: () => { line.close(); cut(); } };
}

/**
 * Opens an address in an empty window; what must not happen is asserted when it is left. `dark` takes WebGL from the page, where
 * no picture is looked at.
 */
export async function open(browser, address, { token = TOKEN, lost = false, dark = false, ...options } = {}) {
  // As a tab keeps it that was let in before.
  const keep = (kept) => {
    if (kept !== null && sessionStorage.getItem('nappe token /') === null) sessionStorage.setItem('nappe token /', kept);
  };
  const scripts = [[keep, token], ...(dark ? [[blind]] : [])];
  const { page, leave, close } = await emptyWindow(browser, { viewport: { width: 900, height: 560 }, ...options, scripts });
  const problems = [];
  // A connection that breaks is an error of the console, too; only where none does, there is none.
  const isExpected = (said) => lost || said.includes('GPU stall due to ReadPixels') || (dark && said.includes('Error creating WebGL context'));
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type()) && !isExpected(message.text())) problems.push(message.text());
  });
  page.on('pageerror', (error) => problems.push(String(error)));
  page.on('dialog', (dialog) => { problems.push(`a dialog: ${dialog.message()}`); void dialog.dismiss(); });
  page.on('request', (request) => {
    if (new URL(request.url()).origin !== new URL(address).origin && !/^(data|blob):/.test(request.url())) problems.push(`a request of ${request.url()}`);
  });
  await page.goto(address);
  return {
    page, problems,
    ready: () => page.evaluate(() => window.nappe.ready),
    text: (id) => page.evaluate((name) => document.getElementById(name).textContent, id),
    notice: () => page.evaluate(() => (document.getElementById('notice').hidden ? '' : document.getElementById('notice').textContent)),
    drawn: () => page.evaluate(() => window.nappe.session?.drawnCount ?? 0),
    leave: async () => {
      await leave();
      assert.deepEqual(problems, []);
    },
    close: async () => {
      await close();
      assert.deepEqual(problems, []);
    },
  };
}

/** MakeLink of the contract, whose answer has the code as its first field; `fields` are the bytes of its request. */
export async function makeLink(address, fields = []) {
  const answer = await fetch(`${address}nappe.v1.SimulationService/MakeLink`, {
    method: 'POST', headers: { 'content-type': 'application/grpc-web+proto', authorization: `Bearer ${TOKEN}` },
    body: Uint8Array.from([0, 0, 0, 0, fields.length, ...fields]),
  });
  const bytes = Buffer.from(await answer.arrayBuffer());
  // Five bytes before the message, then the field's number and its length.
  assert.deepEqual([bytes[0], bytes[5]], [0, 0x0a], `MakeLink answers: ${bytes}`);
  return bytes.subarray(7, 7 + bytes[6]).toString('latin1');
}
