// Writes a recording of a cloth that falls on a ball, a rope of springs, and snow: node tests/sample.mjs OUT.html
// [--frames N] [--far METRES] [--side PARTICLES] [--color NAME] [--shapes] [--cut]. None of it was simulated.

import { readFileSync, writeFileSync } from 'node:fs';
import { parseArgs } from 'node:util';
import { pack } from '../../../client/typescript/tests/pack.mjs';
import { torus } from './solids.mjs';

const KEY_EVERY = 12;
const DT = 1 / 60;
const SNOW_SIDE = 14;
const ROPE = 24;

const base64 = (bytes) => Buffer.from(bytes).toString('base64');
const escaped = (value) => JSON.stringify(value).replaceAll('<', '\\u003c');
const line = (name, value) => `<script type="application/json" class="nappe-${name}">${escaped(value)}</script>\n`;

function packed(rows) {
  const components = rows[0].length;
  return { count: rows.length, data: base64(pack(Int32Array.from(rows.flat()), rows.length, components)) };
}

/** A closed surface as a shape of the head. */
export const mesh = ({ points, triangles }) => (
  { kind: 'mesh', points: base64(Float32Array.from(points.flat()).buffer), triangles: packed(triangles) }
);

function clothTriangles(side) {
  const triangles = [];
  for (let row = 0; row + 1 < side; row++) {
    for (let column = 0; column + 1 < side; column++) {
      const a = row * side + column;
      triangles.push([a, a + side, a + 1], [a + 1, a + side, a + side + 1]);
    }
  }
  return triangles;
}

/** A cloth of 2 m above a ball of radius 0.4 m, at a time (s). */
function cloth(side, time) {
  return Array.from({ length: side * side }, (_, i) => {
    const [u, v] = [(i % side) / (side - 1) - 0.5, Math.floor(i / side) / (side - 1) - 0.5];
    const [r, angle] = [2 * Math.hypot(u, v), Math.atan2(v, u)];
    const drop = Math.min(1, Math.max(0, time - 0.1) * 2);
    const height = r < 0.4 ? Math.sqrt(0.4 ** 2 - r * r) : 0;
    const fold = 0.06 * r * Math.sin(6 * angle + 3 * time);
    const inward = 1 - 0.35 * drop * Math.min(1, r / 1.4);
    const y = (1 - drop) * 1.1 + drop * (0.45 + height - 0.55 * Math.max(0, r - 0.3) + fold);
    return [2 * u * inward, Math.max(y, 0.02), 2 * v * inward];
  });
}

function rope(time) {
  return Array.from({ length: ROPE }, (_, i) => {
    const swing = 0.6 * Math.sin(3 * time) * (i / ROPE);
    return [-1.4 + swing, 1.6 - i * 0.05, -0.3 + 0.1 * Math.sin(i * 0.3 + time)];
  });
}

function snow(time, count) {
  return Array.from({ length: count }, (_, i) => {
    const [x, y, z] = [i % SNOW_SIDE, Math.floor(i / SNOW_SIDE) % SNOW_SIDE, Math.floor(i / SNOW_SIDE ** 2)];
    const spread = 1 + 0.6 * time * (1 - y / SNOW_SIDE);
    const noise = 0.008 * Math.sin(12.9898 * i);
    return [1.3 + (x - SNOW_SIDE / 2) * 0.035 * spread + noise, Math.max(0.02, y * 0.035 + 0.5 - 1.5 * time), (z - SNOW_SIDE / 2) * 0.035 * spread];
  });
}

/** Around 1; a speed grows with the frames. */
const scalars = (frame, color, count) => Array.from({ length: count }, (_, i) => (color === 'speed' ? frame : 1) * (1 + 0.5 * Math.sin(i * 0.002 + frame * 0.1)));

function colliders(far, shapes) {
  const at = (x, y, z) => [x + far, y, z];
  const still = [0, 0, 0];
  const all = [
    { name: 'ground', velocity: still, shape: { kind: 'plane', point: at(0, 0, 0), normal: [0, 1, 0] } },
    { name: 'ball', velocity: still, shape: { kind: 'sphere', center: at(0, 0.45, 0), radius: 0.4 } },
  ];
  if (!shapes) return all;
  const low = { kind: 'plane', point: at(0, -2, 0), normal: [0, 1, 0] };
  return [
    { ...all[0], shape: low },
    all[1],
    { name: 'capsule', velocity: [0.5, 0, 0], shape: { kind: 'capsule', start: at(-1, 0.2, 1.2), end: at(-0.4, 0.5, 1.2), radius: 0.15 } },
    { name: 'box', velocity: still, shape: { kind: 'box', center: at(0.7, 0.25, -1.2), half_extent: [0.4, 0.25, 0.2], axis_x: [Math.SQRT1_2, 0, Math.SQRT1_2], axis_y: [0, 1, 0] } },
    { name: 'cylinder', velocity: still, shape: { kind: 'cylinder', start: at(-1.4, 0, -1), end: at(-1.4, 0.7, -0.8), radius: 0.2 } },
    { name: 'pipe', velocity: still, shape: { kind: 'half_pipe', point: at(0, 0, -2.4), axis: [1, 0, 0], up: [0, 1, 0], radius: 0.6 } },
    { name: 'ring', velocity: [0, 0, 0.2], shape: mesh(torus(at(1.5, 0.3, 1), 0.35, 0.12, 32, 16)) },
  ];
}

function head(side, particles, options) {
  const first = side * side;
  return {
    format: 1, program: 'nappe 0.1.0', title: 'A sample </script> that was not simulated', scene: 'title = "a sample"\n# <b>no markup</b>',
    particles, dt_seconds: DT, precision: 'f32', bound: 1.2e-4, color: options.color,
    bodies: [
      { name: 'cloth', first_particle: 0, particle_count: first, triangles: packed(clothTriangles(side)), springs: null, pins: [0, side - 1] },
      { name: 'rope', first_particle: first, particle_count: ROPE, triangles: null, pins: [first],
        springs: packed(Array.from({ length: ROPE - 1 }, (_, i) => [first + i, first + i + 1])) },
      { name: 'snow', first_particle: first + ROPE, particle_count: particles - first - ROPE, triangles: null, springs: null, pins: [] },
    ].filter(({ particle_count: count }) => count > 0),
    colliders: colliders(options.far, options.shapes),
  };
}

/** The text of a recording: the page, then its data. */
export function sample(page, options = {}) {
  const { frames = 40, far = 0, side = 48, color = 'plastic_ratio', shapes = false, cut = false, snowy = true } = options;
  const grains = snowy ? SNOW_SIDE ** 3 : 0;
  const particles = side * side + ROPE + grains;
  const [step, scalarStep] = [far === 0 ? 2 ** -12 : 2 ** -8, 2 ** -10];
  const lines = [page, line('head', head(side, particles, { far, color, shapes }))];

  let base = null;
  for (let first = 0; first < frames; first += KEY_EVERY) {
    base = null;
    const block = { step, bound: step / 2, scalar_step: scalarStep, frames: [] };
    for (let frame = first; frame < Math.min(first + KEY_EVERY, frames); frame++) {
      const time = frame * DT;
      const points = [...cloth(side, time), ...rope(time), ...snow(time, grains)].map(([x, y, z]) => [x + far, y, z]);
      const numbers = Int32Array.from(points.flat(), (x) => Math.round(x / step));
      const scalar = Int32Array.from([...new Array(side * side + ROPE).fill(1), ...scalars(frame, color, grains)], (x) => Math.round(x / scalarStep));
      block.frames.push({
        frame, step: frame, time, positions: base64(pack(numbers, particles, 3, base?.numbers)), scalar: base64(pack(scalar, particles, 1, base?.scalar)),
        kinetic: 12 * time ** 2, elastic: 3 * Math.sin(4 * time) ** 2, gravitational: 30 - 14 * time ** 2, stretch: 0.02 * Math.sin(5 * time) ** 2, dt: DT / 4,
      });
      base = { numbers, scalar };
    }
    lines.push(line('block', block));
  }
  if (cut) {
    const last = lines.pop();
    return lines.join('') + last.slice(0, last.length / 2);
  }
  return lines.join('') + line('end', { frames, steps: frames, hash: '0123456789abcdef', finished: true });
}

if (process.argv[1] === new URL(import.meta.url).pathname) {
  const options = { frames: { type: 'string' }, far: { type: 'string' }, side: { type: 'string' }, color: { type: 'string' }, shapes: { type: 'boolean' }, cut: { type: 'boolean' } };
  const { values, positionals } = parseArgs({ options, allowPositionals: true });
  const numbers = Object.fromEntries(['frames', 'far', 'side'].filter((name) => values[name] !== undefined).map((name) => [name, Number(values[name])]));
  const page = readFileSync(new URL('../dist/replay.html', import.meta.url), 'utf8');
  writeFileSync(positionals[0], sample(page, { ...values, ...numbers }));
}
