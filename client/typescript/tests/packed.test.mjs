// The page's decoder against the golden vectors that Rust wrote, and against bytes that are no packed array.

import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { test } from 'node:test';
import { deflateRawSync } from 'node:zlib';
import { load } from './bundle.mjs';
import { pack } from './pack.mjs';

const { PackedError, restore, unpack } = await load('src/packed.ts');
const folder = new URL('../../../proto/tests/packed/', import.meta.url);
const names = readdirSync(folder).filter((name) => name.endsWith('.json'));
const golden = (name) => JSON.parse(readFileSync(new URL(name, folder), 'utf8'));
const bytes = (digits) => new Uint8Array(Buffer.from(digits, 'hex'));
const base = (numbers) => (numbers === null ? null : Int32Array.from(numbers));

test('there are golden vectors', () => assert.ok(names.length > 0));

for (const name of names) {
  test(`${name} is unpacked bit by bit`, async () => {
    const vector = golden(name);
    const numbers = await unpack(bytes(vector.bytes), vector, base(vector.base));
    assert.deepEqual(Array.from(numbers), vector.numbers);

    const bits = (floats) => Array.from(new Uint32Array(floats.buffer));
    const restored = restore(numbers, vector.step);
    assert.deepEqual(bits(restored), bits(Float32Array.from(vector.restored)));
    vector.values.forEach((value, i) => assert.ok(Math.abs(Math.fround(value) - restored[i]) <= vector.bound));
  });
}

test('numbers that need all four bytes, and sums that wrap, come back', async () => {
  const numbers = Int32Array.from([2 ** 31 - 1, -(2 ** 31), 0, 5, -5, 123456789]);
  const shape = { particles: 2, components: 3 };
  assert.deepEqual(await unpack(pack(numbers, 2, 3), shape, null), numbers);
  const other = Int32Array.from([-1, 7, 2 ** 31 - 1, -(2 ** 31), 1, 0]);
  assert.deepEqual(await unpack(pack(numbers, 2, 3, other), shape, other), numbers);
});

const SHAPE = { particles: 4, components: 1 };
const GOOD = pack(Int32Array.from([1, 2, 3, 70000]), 4, 1);
const refuses = (data, shape = SHAPE, from = null) => assert.rejects(unpack(data, shape, from), PackedError);

test('another shape is refused', async () => {
  await refuses(GOOD, { particles: 5, components: 1 });
  await refuses(GOOD, { particles: 0, components: 3 });
  await refuses(GOOD, SHAPE, new Int32Array(3));
});

// Bytes that follow are refused by browsers; Node before 22 leaves them unread.
test('bytes that are missing are refused', async () => {
  for (let length = 0; length < GOOD.length; length++) await refuses(GOOD.subarray(0, length));
});

test('bytes that are no deflate are refused', () => refuses(new Uint8Array([255, 254, 253, 252])));

test('no more than four bytes per number are inflated, and no fewer than one', async () => {
  await refuses(new Uint8Array(deflateRawSync(new Uint8Array(1e8))));
  await refuses(new Uint8Array(deflateRawSync(new Uint8Array(20))));
  await refuses(new Uint8Array(deflateRawSync(new Uint8Array(7))));
  await refuses(new Uint8Array(deflateRawSync(new Uint8Array(0))));
});
