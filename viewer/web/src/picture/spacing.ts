// The distance of particles that fill a volume, from their positions alone.

/** Particles that are asked for their neighbours. */
const SAMPLES = 32;
/** Neighbours that each looks for: they and itself fill the ball that reaches the farthest of them. */
const NEIGHBOURS = 8;

/**
 * Side of the cube (m) that a particle has to itself: the median over some particles. Positions are x y z of
 * each. Null for too few, or if they lie on each other.
 */
export function spacing(positions: Float32Array, samples = SAMPLES): number | null {
  const count = positions.length / 3;
  if (count <= NEIGHBOURS) return null;
  const step = Math.ceil(count / samples);

  const squares = new Float32Array(count);
  const sides: number[] = [];
  for (let center = 0; center < count; center += step) {
    for (let point = 0; point < count; point++) {
      const x = positions[3 * point] - positions[3 * center];
      const y = positions[3 * point + 1] - positions[3 * center + 1];
      const z = positions[3 * point + 2] - positions[3 * center + 2];
      squares[point] = x * x + y * y + z * z;
    }
    // The particle itself comes first, at distance 0.
    const radius = Math.sqrt(smallest(squares, NEIGHBOURS));
    sides.push(Math.cbrt(((4 / 3) * Math.PI * radius ** 3) / NEIGHBOURS));
  }

  sides.sort((a, b) => a - b);
  const side = sides[sides.length >> 1];
  return Number.isFinite(side) && side > 0 ? side : null;
}

/** The number at `index` if they were sorted, for a small index. */
function smallest(numbers: Float32Array, index: number): number {
  const least = new Float64Array(index + 1).fill(Infinity);
  for (const number of numbers) {
    if (number >= least[index]) continue;
    let at = index;
    for (; at > 0 && least[at - 1] > number; at--) least[at] = least[at - 1];
    least[at] = number;
  }
  return least[index];
}
