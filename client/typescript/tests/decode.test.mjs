// Made messages: what the joiners accept comes back as it was sent, whatever the pieces; what they refuse, they name.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { create } from '@bufbuild/protobuf';
import { load } from './bundle.mjs';

const { FrameJoiner } = await load('src/frame.ts');
const { Pieces } = await load('src/framing.ts');
const { sameTopology, TopologyJoiner } = await load('src/topology.ts');
const { meshOf } = await load('src/colliders.ts');
const { BodyRole, Encoding, Field, FrameSchema, TopologySchema } = await load('src/gen/nappe/v1/frame_pb.ts');

/** Repeatable, uniform in 0 to 1. */
function random(seed) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

const bytes = (array) => new Uint8Array(array.buffer);
const topology = (id, particles, bodies = [{ name: 'all', firstParticle: 0, particleCount: particles }], more = {}) =>
  create(TopologySchema, { topologyId: id, particleCount: particles, bodies, ...more });

test('messages are cut from chunks of any size', async () => {
  const draw = random(1);
  for (let round = 0; round < 200; round++) {
    const messages = Array.from({ length: 1 + Math.floor(8 * draw()) }, () => Uint8Array.from({ length: Math.floor(300 * draw()) }, () => 256 * draw()));
    const body = Buffer.concat(messages.map((message, i) => Buffer.concat([Buffer.from([i + 1 === messages.length ? 0x80 : 0, 0, 0, message.length >> 8, message.length & 255]), message])));
    const chunks = [];
    for (let at = 0; at < body.length; ) {
      const end = at + Math.floor(40 * draw());
      chunks.push(new Uint8Array(body.subarray(at, end)));
      at = end;
    }
    const pieces = new Pieces(async () => chunks.shift() ?? null);
    for (const [i, message] of messages.entries()) {
      const piece = await pieces.next();
      assert.deepEqual([piece.isTrailers, Uint8Array.from(piece.bytes)], [i + 1 === messages.length, message]);
    }
    assert.equal(await pieces.next(), null);
  }
});

/** The pieces of a frame of random numbers, cut at random particles. */
function pieces(draw, particles, encoding) {
  const make = encoding === Encoding.RAW_F64 ? Float64Array : Float32Array;
  const arrays = [[Field.POSITIONS, 3], [Field.STRESS_NORM, 1]].map(([field, width]) => ({ field, width, numbers: make.from({ length: width * particles }, () => draw() - 0.5) }));
  const parts = arrays.flatMap(({ field, width, numbers }) => {
    const cut = Math.floor(draw() * (particles + 1));
    const data = (from, to) => ({ field, encoding, firstParticle: from, data: bytes(numbers.slice(width * from, width * to)) });
    return [data(0, cut), data(cut, particles)];
  });
  const messages = [];
  for (const part of parts) {
    if (messages.length > 0 && draw() < 0.5) messages.at(-1).push(part);
    else messages.push([part]);
  }
  const count = messages.length;
  const wire = messages.map((fields, index) => create(FrameSchema, { frame: 7n, topologyId: 3, timeSeconds: 0.5, fields, ...(count === 1 ? {} : { chunk: { index, count } }) }));
  return { wire, positions: arrays[0].numbers, stress: arrays[1].numbers };
}

test('a frame comes back as it was sent, whatever its pieces', () => {
  const draw = random(2);
  for (let round = 0; round < 300; round++) {
    const particles = Math.floor(20 * draw());
    const joiner = new FrameJoiner(['stress']);
    joiner.begin(new TopologyJoiner().add(topology(3, particles)));
    const made = pieces(draw, particles, draw() < 0.5 ? Encoding.RAW_F64 : Encoding.RAW_F32);
    const frames = made.wire.map((piece) => joiner.add(piece, 10, null));
    const frame = frames.pop();
    assert.ok(frames.every((none) => none === null));
    assert.deepEqual([frame.frame, frame.positions, frame.fields.stress, frame.bytes], [7n, made.positions, made.stress, 10 * made.wire.length]);
    frame.release();
  }
});

test('a frame that does not fit is refused by name', () => {
  const points = (numbers, more = {}) => ({ field: Field.POSITIONS, encoding: Encoding.RAW_F32, data: bytes(Float32Array.from(numbers)), ...more });
  const whole = [1, 2, 3, 4, 5, 6];
  const frame = (fields, more = {}) => create(FrameSchema, { frame: 7n, topologyId: 3, fields, ...more });
  const refusal = (...wire) => {
    const joiner = new FrameJoiner([]);
    joiner.begin(new TopologyJoiner().add(topology(3, 2)));
    assert.throws(() => wire.forEach((piece) => joiner.add(piece, 0, null)), ({ codeName, message }) => codeName === 'DATA_LOSS' && (refusal.words = message) !== '');
    return refusal.words;
  };
  const first = { chunk: { index: 0, count: 2 } };
  assert.match(refusal(frame([points(whole)], { topologyId: 4 })), /topology 4/);
  assert.match(refusal(frame([points(whole)], { timeSeconds: Number.NaN })), /time is NaN/);
  assert.match(refusal(frame([points(whole)], { chunk: { index: 1, count: 2 } })), /piece 1 of 2 came where piece 0/);
  assert.match(refusal(frame([points(whole)], { chunk: { index: 0, count: 0 } })), /piece 0 of 0/);
  assert.match(refusal(frame([points(whole)], first), frame([], { chunk: { index: 1, count: 3 } })), /piece 1 of 3/);
  assert.match(refusal(frame([points(whole)], first), frame([points(whole)], { frame: 8n })), /frame 7 broke off after 1 of 2 pieces: frame 8/);
  assert.match(refusal(frame([])), /positions of 0 of 2/);
  assert.match(refusal(frame([points(whole.slice(0, 3))])), /positions of 1 of 2/);
  assert.match(refusal(frame([points(whole.slice(0, 4))])), /16 bytes of positions, no multiple of 12/);
  assert.match(refusal(frame([points([...whole, 7, 8, 9])])), /go on at particle 0 of 2/);
  assert.match(refusal(frame([points(whole, { firstParticle: 1 })])), /go on at particle 1/);
  assert.match(refusal(frame([points(whole, { encoding: 9 })])), /encoding 9/);
  assert.match(refusal(frame([points(whole.slice(0, 3)), points(whole.slice(0, 3), { encoding: Encoding.RAW_F64, firstParticle: 1 })])), /change their encoding/);
  for (const number of [Number.NaN, Infinity, -Infinity]) assert.match(refusal(frame([points([1, 2, 3, 4, number, 6])])), /positions of particle 1 is (NaN|-?Infinity)/);

  const before = new FrameJoiner([]);
  assert.throws(() => before.add(frame([points(whole)]), 0, null), /did not come/);
});

test('poses come with the first piece, or are refused by name', () => {
  const colliders = ['box', 'lid'].map((name) => ({ name }));
  const half = (index, poses) => create(FrameSchema, {
    frame: 7n, topologyId: 3, chunk: { index, count: 2 }, poses,
    fields: [{ field: Field.POSITIONS, encoding: Encoding.RAW_F32, firstParticle: index, data: bytes(Float32Array.of(1, 2, 3)) }],
  });
  const read = (...poses) => {
    const joiner = new FrameJoiner([]);
    joiner.begin(new TopologyJoiner().add(topology(3, 2, undefined, { colliders })));
    joiner.add(half(0, poses), 0, null);
    return joiner.add(half(1, []), 0, null).poses;
  };
  const pose = (name, x, turn = { y: 0.6, w: 0.8 }) => ({ name, position: { x, y: 2, z: 3 }, turn });
  assert.deepEqual(read(pose('lid', 1), { name: 'box' }), [
    { name: 'lid', position: [1, 2, 3], turn: [0, 0.6, 0, 0.8] }, { name: 'box', position: [0, 0, 0], turn: [0, 0, 0, 1] },
  ]);
  assert.deepEqual(read(), []);
  for (const [poses, words] of [
    [[pose('it', 1)], /collider 'it': no collider has this name/],
    [[pose('box', 1), pose('box', 1)], /collider 'box': .*twice/],
    [[pose('box', Number.NaN)], /not finite/],
    [[pose('box', 1, {})], /length 1/],
    [[pose('box', 1, { w: 1 + 2e-6 })], /length 1/],
    [[pose('box', 1, { w: Number.NaN })], /length 1/],
  ]) assert.throws(() => read(...poses), words);
});

test('a frame in the making is void where a stream begins anew', () => {
  const draw = random(3);
  const joiner = new FrameJoiner(['stress']);
  joiner.begin(new TopologyJoiner().add(topology(3, 4)));
  let made;
  do made = pieces(draw, 4, Encoding.RAW_F32);
  while (made.wire.length < 2);
  assert.equal(joiner.add(made.wire[0], 1, null), null);
  joiner.begin(new TopologyJoiner().add(topology(3, 4)));
  assert.deepEqual(made.wire.map((piece) => joiner.add(piece, 1, null)).at(-1).positions, made.positions);
});

const u32 = (...numbers) => bytes(Uint32Array.from(numbers));

test('a body goes on from piece to piece, and begins anew with piece 0', () => {
  const roles = { a: BodyRole.CLOTH, b: BodyRole.FIGURE };
  const body = (name, firstParticle, particleCount, triangles) => ({ name, firstParticle, particleCount, trianglesU32: triangles, role: roles[name] ?? 7 });
  const joiner = new TopologyJoiner();
  const piece = (index, bodies) => topology(1, 7, bodies, { chunk: { index, count: 3 }, colliders: index === 0 ? [{ name: 'ball', shape: { case: 'sphere', value: { radius: 1 } } }] : [] });
  const lent = u32(0, 1, 2);
  const one = piece(0, [body('a', 0, 5, lent), body('b', 5, 1, u32(5, 5))]);
  assert.equal(joiner.add(piece(0, [])), null);
  assert.equal(joiner.add(one), null);
  // The memory of a message is that of the next one.
  lent.fill(9);
  assert.equal(joiner.add(piece(1, [body('b', 5, 1, u32(5))])), null);
  const whole = joiner.add(piece(2, [body('c', 6, 1, u32())]));
  const lists = whole.bodies.map(({ name, triangles }) => [name, ...triangles]);
  assert.deepEqual(lists, [['a', 0, 1, 2], ['b', 5, 5, 5], ['c']]);
  assert.deepEqual(whole.bodies.map(({ role }) => role), ['cloth', 'figure', null]);
  assert.equal(whole.colliders[0].name, 'ball');
  assert.ok(sameTopology(whole, { ...whole, bodies: structuredClone(whole.bodies) }));
  const other = structuredClone(whole.bodies);
  other[1].triangles[2] = 4;
  assert.ok(!sameTopology(whole, { ...whole, bodies: other }) && !sameTopology(whole, { ...whole, id: 2 }));
});

test('a topology that does not fit is refused by name', () => {
  const refused = (wire, words) => assert.throws(() => new TopologyJoiner().add(wire), ({ message }) => words.test(message), String(words));
  const body = { name: 'a', firstParticle: 0, particleCount: 2 };
  refused(topology(1, (1 << 24) + 1), /16777217 particles are announced/);
  refused(topology(1, 3, [body]), /hold 2 of 3/);
  refused(topology(1, 1, [body]), /body 'a' starts at particle 0 and has 2/);
  refused(topology(1, 2, [{ ...body, firstParticle: 1 }]), /starts at particle 1/);
  refused(topology(1, 2, [{ ...body, trianglesU32: u32(0, 1) }]), /trianglesU32 of body 'a' take 8 bytes, no multiple of 12/);
  refused(topology(1, 2, [{ ...body, trianglesU32: u32(0, 1, 2) }]), /triangles of body 'a' name particle 2; allowed: 0 to 1/);
  refused(topology(1, 2, [{ ...body, springsU32: u32(0, 7) }]), /springs of body 'a' name particle 7/);
  refused(topology(1, 2, [{ ...body, pinsU32: u32(4294967295) }]), /pins of body 'a' name particle 4294967295/);
  refused(topology(1, 2, [{ ...body, uvF32: u32(0, 0) }]), /1 texture coordinates for 2/);
  refused(topology(1, 2, [{ ...body, massF32: u32(0) }]), /1 masses for 2 particles/);
  refused(topology(1, 2, [{ ...body, volumeF32: bytes(Float32Array.of(1, NaN)) }]), /2 volumes for 2 particles, all of which have to be finite/);
  refused(topology(1, 2, [body], { chunk: { index: 1, count: 2 } }), /piece 1 of 2 came where piece 0/);
  refused(topology(1, 2, [body], { chunk: { index: 0, count: 0 } }), /piece 0 of 0/);
});

test('a collider that cannot be drawn is refused by name', () => {
  const [x, y] = [{ x: 1, y: 0, z: 0 }, { x: 0, y: 1, z: 0 }];
  const shape = (kind, value) => ({ name: 'it', shape: { case: kind, value } });
  const refused = (collider, words) => assert.throws(() => new TopologyJoiner().add(topology(1, 0, [], { colliders: [collider] })), words);
  refused({ name: 'it', velocity: { x: Number.NaN } }, /collider 'it': a coordinate is not finite/);
  refused(shape('plane', { normal: { x: 2 } }), /not of length 1/);
  refused(shape('sphere', { radius: 0 }), /radius/);
  refused(shape('capsule', { end: { x: Infinity }, radius: 1 }), /not finite/);
  refused(shape('box', { halfExtent: { x: 1, y: 1, z: 0 }, axisX: x, axisY: y }), /extent/);
  refused(shape('box', { halfExtent: { x: 1, y: 1, z: 1 }, axisX: x, axisY: x }), /right angles/);
  refused(shape('cylinder', { start: x, end: x, radius: 1 }), /one point/);
  refused(shape('halfPipe', { axis: x, up: y, radius: Number.NaN }), /radius/);
  const fine = [shape('plane', { normal: y }), shape('halfPipe', { axis: x, up: y, radius: 1 }), { name: 'of a newer server' }];
  assert.equal(new TopologyJoiner().add(topology(1, 0, [], { colliders: fine })).colliders.length, 3);
});

const CORNERS = [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1];
const TRIANGLES = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2];

/** A tetrahedron, with these arrays in place of its own. */
const mesh = (points = bytes(Float32Array.from(CORNERS)), triangles = u32(...TRIANGLES), name = 'it') =>
  ({ name, velocity: { z: 2 }, shape: { case: 'mesh', value: { pointsF32: points, trianglesU32: triangles, origin: { x: 4, z: 5 } } } });

test('a mesh goes on from piece to piece', () => {
  const [ball, whole] = [{ name: 'ball', shape: { case: 'sphere', value: { radius: 1 } } }, mesh()];
  const { pointsF32, trianglesU32 } = whole.shape.value;
  const expected = new TopologyJoiner().add(topology(1, 0, [], { colliders: [ball, whole, mesh(pointsF32, trianglesU32, 'other')] }));
  for (const size of [1, 7, 12, 48]) {
    const count = Math.ceil(48 / size);
    const joiner = new TopologyJoiner();
    let read = null;
    for (let index = 0; index < count; index++) {
      const part = (array) => array.slice(size * index, size * (index + 1));
      const lent = [part(pointsF32), part(trianglesU32)];
      const colliders = [...(index === 0 ? [ball] : []), mesh(...lent), ...(index + 1 === count ? [mesh(pointsF32, trianglesU32, 'other')] : [])];
      read = joiner.add(topology(1, 0, [], { chunk: { index, count }, colliders }));
      assert.equal(read !== null, index + 1 === count);
      // The memory of a message is that of the next one.
      for (const array of lent) array.fill(255);
    }
    assert.deepEqual(read.colliders.map(({ name }) => name), ['ball', 'it', 'other']);
    const { kind, points, triangles, origin } = meshOf(read.colliders[1].shape.value);
    assert.deepEqual([kind, [...points], [...triangles], origin], ['mesh', CORNERS, TRIANGLES, [4, 0, 5]], `parts of ${size} bytes`);
    assert.equal(read.colliders[1].velocity.z, 2);
    assert.ok(sameTopology(read, expected));
  }
  const other = (at, value) => {
    const points = CORNERS.with(at, value);
    return new TopologyJoiner().add(topology(1, 0, [], { colliders: [ball, mesh(bytes(Float32Array.from(points))), mesh(pointsF32, trianglesU32, 'other')] }));
  };
  assert.ok(sameTopology(other(5, 0), expected) && !sameTopology(other(5, 0.5), expected));
});

test('a mesh that cannot be drawn is refused by name', () => {
  const refused = (colliders, words) => assert.throws(() => new TopologyJoiner().add(topology(1, 0, [], { colliders })), ({ message }) => message.includes(`collider 'it': `) && words.test(message), String(words));
  refused([mesh(bytes(Float32Array.from(CORNERS.with(3, Number.NaN))))], /not finite/);
  refused([{ ...mesh(), velocity: { x: Infinity } }], /not finite/);
  refused([mesh(undefined, u32(0, 1, 4))], /names a point that is not there/);
  refused([mesh(undefined, u32(0, 1))], /no whole number of points and triangles/);
  refused([mesh(new Uint8Array(49))], /no whole number of points and triangles/);
  refused([mesh(undefined, u32())], /no triangles/);
  refused([mesh(), mesh(undefined, undefined, 'other'), mesh()], /go on behind another collider/);
});
