// Colliders are drawn where the frames say: solids at their poses, about their reference points, and all others where their
// velocities have brought them.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './bundle.mjs';
import { box } from './solids.mjs';

const { Colliders } = await load('src/picture/colliders.ts');
const { meshShape } = await load('src/picture/extent.ts');
const { readPoses } = await load('src/recording/poses.ts');
const { Bounds } = await load('src/picture/geometry.ts');
const { readHead } = await load('src/recording/head.ts');
const { sceneOf } = await load('src/live/live_scene.ts');
const { ColliderShapeSchema } = await load('../../client/typescript/src/gen/nappe/v1/frame_pb.ts');

const ORIGIN = [2, 0, -1];
const STILL = [0, 0, 0];
const HALF = Math.SQRT1_2;

function bounds() {
  const made = new Bounds();
  for (const corner of [[-1, -1, -1], [1, 1, 1]]) made.add(corner);
  return made;
}

const drawn = (shape, velocity = STILL) => new Colliders([{ name: 'it', velocity, shape }], bounds(), ORIGIN);

/** Where a point of an object is in the world. */
function world(colliders, [x, y, z]) {
  const [object] = colliders.objects;
  object.updateMatrixWorld();
  const at = object.position.clone().set(x, y, z).applyMatrix4(object.matrixWorld);
  return [at.x + ORIGIN[0], at.y + ORIGIN[1], at.z + ORIGIN[2]];
}

function near(found, expected, what = '') {
  found.forEach((part, axis) => assert.ok(Math.abs(part - expected[axis]) < 1e-9, `${what}: ${found}, not ${expected}`));
}

const solid = { kind: 'box', center: [0, 1, 0], half_extent: [0.4, 0.2, 0.1], axis_x: [0, 1, 0], axis_y: [-1, 0, 0] };

test('a turning box is at its pose in frames 0, 10 and 20', () => {
  const colliders = drawn(solid);
  for (const frame of [0, 10, 20]) {
    const angle = (Math.PI / 2) * (frame / 20);
    const pose = { name: 'it', position: [0.1 * frame, 1, 0], turn: [0, Math.sin(angle / 2), 0, Math.cos(angle / 2)] };
    colliders.update({ time: 0.01 * frame, poses: [pose] });
    near(world(colliders, [0, 0, 0]), pose.position, `frame ${frame}`);
    // Its own x points up, its own y against x, its own z along z; all turn about y, which takes x to -z.
    near(world(colliders, [1, 0, 0]), [0.1 * frame, 2, 0], `x in frame ${frame}`);
    near(world(colliders, [0, 1, 0]), [0.1 * frame - Math.cos(angle), 1, Math.sin(angle)], `y in frame ${frame}`);
    near(world(colliders, [0, 0, 1]), [0.1 * frame + Math.sin(angle), 1, Math.cos(angle)], `z in frame ${frame}`);
  }
});

test('without a pose a collider goes with its velocity, and is not turned, also after it was', () => {
  const colliders = drawn(solid, [0.5, 0, 0]);
  const start = world(colliders, [1, 2, 3]);
  colliders.update({ time: 2, poses: [{ name: 'it', position: [5, 5, 5], turn: [0, HALF, 0, HALF] }] });
  colliders.update({ time: 2, poses: [{ name: 'another', position: [5, 5, 5], turn: [0, HALF, 0, HALF] }] });
  near(world(colliders, [1, 2, 3]), [start[0] + 1, start[1], start[2]]);
});

test('a mesh turns about its reference point, and grounds turn about their own', () => {
  const { points, triangles } = box([1, 0, 0], [0.5, 0.5, 0.5]);
  const mesh = meshShape(Float32Array.from(points.flat()), Uint32Array.from(triangles.flat()), [0, 0, 0]);
  const pose = { name: 'it', position: [3, 0, 0], turn: [0, HALF, 0, HALF] };
  const shapes = [
    [mesh, [3, 0, -1]],
    [{ kind: 'capsule', start: [0, 0, 0], end: [2, 0, 0], radius: 0.2 }, [3, 0, 0]],
    [{ kind: 'plane', point: [0, 1, 0], normal: [0, 1, 0] }, [3, 0, 0]],
    [{ kind: 'half_pipe', point: [0, 1, 0], axis: [1, 0, 0], up: [0, 1, 0], radius: 1 }, [3, 0, 0]],
  ];
  for (const [shape, middle] of shapes) {
    const colliders = drawn(shape);
    colliders.update({ time: 0, poses: [pose] });
    near(world(colliders, [0, 0, 0]), middle, shape.kind);
  }
});

/** Numbers of each shape of the contract but a mesh, under the names of the contract. */
const SHAPES = {
  plane: { point: [0, 1, 0], normal: [0, 1, 0] },
  sphere: { center: [1, 2, 3], radius: 0.5 },
  capsule: { start: [0, 0, 0], end: [0, 1, 0], radius: 0.25 },
  box: { center: [1, 2, 3], half_extent: [1, 2, 0.5], axis_x: [1, 0, 0], axis_y: [0, 0, 1] },
  cylinder: { start: [0, 0, 0], end: [0, 1, 0], radius: 0.25 },
  half_pipe: { point: [0, 2, 0], axis: [0, 0, 1], up: [0, 1, 0], radius: 2 },
};

test('every shape of the contract is read from a stream and from a file, and drawn', async () => {
  const shapes = ColliderShapeSchema.oneofs.find(({ name }) => name === 'shape').fields;
  assert.deepEqual(shapes.map(({ name }) => name).sort(), [...Object.keys(SHAPES), 'mesh'].sort());
  const asSent = (number) => (Array.isArray(number) ? { x: number[0], y: number[1], z: number[2] } : number);
  for (const { name, localName, message } of shapes.filter((shape) => shape.name !== 'mesh')) {
    const shape = { kind: name, ...SHAPES[name] };
    const value = Object.fromEntries(message.fields.map((field) => [field.localName, asSent(SHAPES[name][field.name])]));
    const sent = { name: 'it', velocity: { x: 0, y: 0, z: 0 }, shape: { case: localName, value } };
    const { colliders } = sceneOf('a stream', { particleCount: 0, bodies: [], colliders: [sent] });
    assert.deepEqual(colliders, [{ name: 'it', velocity: STILL, shape }]);
    const { scene } = await readHead({ format: 1, title: 'a file', particles: 0, bodies: [], colliders: [{ name: 'it', velocity: STILL, shape }] });
    assert.deepEqual(scene.colliders, colliders);
    assert.equal(drawn(shape).objects.length, 1);
  }
});

test('poses of a file are read, and what is none is said', () => {
  const pose = { name: 'it', position: [1, 2, 3], turn: [0, 0.6, 0, 0.8] };
  assert.deepEqual(readPoses([pose]), [pose]);
  assert.deepEqual([readPoses(undefined), readPoses(null)], [[], []]);
  assert.throws(() => readPoses([{ ...pose, turn: [0, 0, 0, 0] }]), /turn of it is no quaternion/);
  assert.throws(() => readPoses([{ ...pose, turn: [0, 0, 1] }]), /turn of it is no quaternion/);
  assert.throws(() => readPoses([{ ...pose, position: [1, 2] }]), /position of it has 2 components/);
  assert.throws(() => readPoses([{ ...pose, name: 3 }]), /name of a pose is no text/);
});
