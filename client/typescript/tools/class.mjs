// A class on this machine: thirty pupils open the link of `nappe class`, copy the scene, play and watch their copies.
// `node tools/class.mjs`, with the command of NAPPE_PROGRAM or the one that was built.
//
// It fails where copies have unequal shares, where a pull in one copy changes another, and where the server takes too much
// memory. Times depend on what else the machine does: they are told beside what is wanted.

import { spawn } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { createInterface } from 'node:readline';
import { load } from '../tests/bundle.mjs';
import { eventually } from '../tests/server.mjs';

const PUPILS = 30;
/** How long shares are counted (s). */
const LESSON = 20;
/** Steps to which copies of one state are taken, all but one without a pull. */
const STEPS = 20n;
/** How far the steps of a copy may be from their mean. */
const MOST_UNEQUAL = 0.2;
const MOST_MEMORY = 1.2e9;
const PULLED = { body: 'sheet', particlesU32: new Uint32Array([780]), frequency: 20, most: 30, seconds: 0.5 };

const ROOT = new URL('../../../', import.meta.url).pathname;
const program = process.env.NAPPE_PROGRAM ?? join(resolve(ROOT, process.env.CARGO_TARGET_DIR ?? 'target', 'release'), 'nappe');
const { connect, SessionState } = await load('src/index.ts');

const wait = (milliseconds) => new Promise((passed) => setTimeout(passed, milliseconds));
const seconds = (since) => (performance.now() - since) / 1000;
const quantile = (values, share) => values.toSorted((a, b) => a - b)[Math.min(values.length - 1, Math.floor(share * values.length))];
const faults = [];

function told(what, value, wanted, isMet) {
  console.log(`${what}: ${value} (wanted: ${wanted})`);
  if (isMet === false) faults.push(what);
}

/** A client that has opened a link. */
async function opened(link) {
  const { host, hash } = new URL(link);
  const client = connect(host);
  client.setToken(await client.openLink(hash.slice(1)));
  return client;
}

/** A pupil: a copy that plays in real time, and a stream of its pictures. */
class Pupil {
  step = -1n;
  isOver = false;

  constructor(client) {
    this.client = client;
  }

  async begin() {
    const begin = performance.now();
    this.copy = await this.client.fork('class');
    await this.client.play(this.copy, { realTimeFactor: 1 });
    this.watching = this.watch();
    await eventually(() => this.step >= 0n);
    return seconds(begin);
  }

  async watch() {
    for await (const frame of this.client.frames(this.copy, { rate: 60 })) {
      this.step = frame.step;
      frame.release();
      if (this.isOver) return;
    }
  }

  /** A new copy in place of the one that there is, paused. */
  async again() {
    this.isOver = true;
    await this.watching;
    await this.client.delete(this.copy);
    this.copy = await this.client.fork('class');
  }

  /** How long a pull takes until a picture has it (s). */
  async pull() {
    const begin = performance.now();
    const { effectiveStep } = await this.client.update(this.copy, { pulls: [{ ...PULLED, pointsF64: new Float64Array([0.5, 0, 0.3]) }] });
    await eventually(() => this.step > effectiveStep);
    return seconds(begin);
  }
}

/** Steps of all copies, by the uids of their sessions. */
async function stepsOf(teacher) {
  const copies = (await teacher.list()).filter(({ sessionId }) => sessionId !== 'class');
  return new Map(copies.map(({ uid, step }) => [uid, Number(step)]));
}

/** Until it is over: how long calls take (s). */
async function calls(teacher, pupils, until) {
  const times = [];
  for (let i = 0; performance.now() < until; i++) {
    const begin = performance.now();
    await teacher.get(pupils[i % pupils.length].copy);
    times.push(seconds(begin));
    await wait(20);
  }
  return times;
}

async function pulls(pupil, until) {
  const times = [];
  while (performance.now() < until) {
    times.push(await pupil.pull());
    await wait(100);
  }
  return times;
}

async function lesson(teacher, pupils) {
  const waited = await Promise.all(pupils.map((pupil) => pupil.begin()));
  told('longest wait for a first picture', `${Math.max(...waited).toFixed(1)} s`, 'at most 10 s');

  const before = await stepsOf(teacher);
  const until = performance.now() + 1000 * LESSON;
  const [times, pulled] = await Promise.all([calls(teacher, pupils, until), pulls(pupils[0], until)]);
  const after = await stepsOf(teacher);
  const taken = [...after].map(([uid, steps]) => steps - before.get(uid));
  const mean = taken.reduce((sum, steps) => sum + steps, 0) / taken.length;
  const [least, most] = [Math.min(...taken) / mean - 1, Math.max(...taken) / mean - 1];
  const shares = `${(100 * least).toFixed(1)} % to +${(100 * most).toFixed(1)} % of ${mean.toFixed(0)} steps`;
  told('shares of copies', shares, 'within 20 %', taken.length === PUPILS && mean > 0 && least > -MOST_UNEQUAL && most < MOST_UNEQUAL);
  told(`GetSession, 99th percentile of ${times.length}`, `${(1000 * quantile(times, 0.99)).toFixed(0)} ms`, 'at most 100 ms');
  told(`from a pull to its picture, median of ${pulled.length}`, `${(1000 * quantile(pulled, 0.5)).toFixed(0)} ms`, 'at most 100 ms');
}

/** Copies of one state go on to the same state, all but the one that is pulled at. */
async function apart(teacher, pupils) {
  await teacher.pause('class');
  for (const pupil of pupils) await pupil.again();
  const pointsF64 = new Float64Array([0.5, 0, 0.3]);
  await pupils[0].client.update(pupils[0].copy, { pulls: [{ ...PULLED, pointsF64 }] });
  const ends = await Promise.all(pupils.map(({ client, copy }) => client.step(copy, 1, { to: copy.step + STEPS })));
  const hashes = ends.map(({ stateHash }) => stateHash);
  const others = new Set(hashes.slice(1));
  const isApart = hashes.every((hash) => hash !== undefined) && others.size === 1 && !others.has(hashes[0]);
  told('states of 29 copies beside one that is pulled at', `${others.size}, ${others.has(hashes[0]) ? 'that of the pulled one' : 'and another one of that'}`, '1, and another one', isApart);
}

const child = spawn(program, ['class', 'hanging_sheet', '--pupils', String(PUPILS), '--address', '127.0.0.1:0', '--json'], {
  stdio: ['ignore', 'pipe', 'inherit'],
});
const ended = new Promise((end) => child.once('exit', end));
const line = await Promise.race([
  new Promise((found) => createInterface({ input: child.stdout }).once('line', found)),
  ended.then((code) => { throw new Error(`nappe class ended with ${code}`); }),
]);
try {
  const { link, class_link: classLink } = JSON.parse(line);
  const teacher = await opened(link);
  if ((await teacher.get('class')).state !== SessionState.PLAYING) throw new Error('the session of the class does not play');
  const pupils = (await Promise.all(Array.from({ length: PUPILS }, () => opened(classLink)))).map((client) => new Pupil(client));
  await lesson(teacher, pupils);
  const resident = Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${child.pid}/status`, 'utf8'))[1]) * 1024;
  told('memory of the server', `${(resident / 1e6).toFixed(0)} MB`, `at most ${MOST_MEMORY / 1e6} MB`, resident < MOST_MEMORY);
  await apart(teacher, pupils);
} finally {
  child.kill('SIGINT');
}
const code = await ended;
if (code !== 0) faults.push(`the end of the class, with ${code}`);
if (faults.length > 0) throw new Error(`not as wanted: ${faults.join('; ')}`);
