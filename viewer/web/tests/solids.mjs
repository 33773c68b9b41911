// Closed surfaces for tests: points (m), and triangles turned outwards.

/** A box of 12 triangles. */
export function box(center, [x, y, z]) {
  const points = Array.from({ length: 8 }, (_, i) => [i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z].map((part, axis) => part + center[axis]));
  const sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
  return { points, triangles: sides.flatMap(([a, b, c, d]) => [[a, b, c], [a, c, d]]) };
}

/** A ball of 20 times 4^levels triangles, whose points lie on the ball. */
export function ball(center, radius, levels) {
  const golden = (1 + Math.sqrt(5)) / 2;
  const points = [[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0]].flatMap(([x, y, z]) => [[x, y, z], [z, x, y], [y, z, x]]);
  let triangles = hull(points);
  for (let level = 0; level < levels; level++) {
    const middles = new Map();
    const middle = (a, b) => {
      const key = a < b ? `${a} ${b}` : `${b} ${a}`;
      if (!middles.has(key)) middles.set(key, points.push(points[a].map((part, axis) => part + points[b][axis])) - 1);
      return middles.get(key);
    };
    triangles = triangles.flatMap(([a, b, c]) => {
      const [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
      for (const index of [ab, bc, ca]) points[index] = toLength(points[index], Math.hypot(...points[a]));
      return [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]];
    });
  }
  return { points: points.map((point) => toLength(point, radius).map((part, axis) => part + center[axis])), triangles };
}

/** The triangles of an icosahedron: three points that are as near as any two. */
function hull(points) {
  const apart = (a, b) => Math.hypot(...points[a].map((part, axis) => part - points[b][axis]));
  const edge = Math.min(...points.slice(1).map((_, i) => apart(0, i + 1))) + 1e-9;
  const triangles = [];
  for (let a = 0; a < 12; a++) for (let b = a + 1; b < 12; b++) for (let c = b + 1; c < 12; c++) {
    if (Math.max(apart(a, b), apart(b, c), apart(c, a)) > edge) continue;
    triangles.push(outwards(points, [a, b, c]));
  }
  return triangles;
}

function outwards(points, [a, b, c]) {
  const [p, q, r] = [a, b, c].map((index) => points[index]);
  const volume = p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) + p[2] * (q[0] * r[1] - q[1] * r[0]);
  return volume > 0 ? [a, b, c] : [a, c, b];
}

const toLength = (point, length) => point.map((part) => (part * length) / Math.hypot(...point));

/** A ring around the y axis through its centre, of 2 times around times across triangles. */
export function torus(center, ring, radius, around, across) {
  const points = [];
  const triangles = [];
  for (let i = 0; i < around; i++) {
    for (let j = 0; j < across; j++) {
      const [turn, angle] = [(2 * Math.PI * i) / around, (2 * Math.PI * j) / across];
      const out = ring + radius * Math.cos(angle);
      points.push([center[0] + out * Math.cos(turn), center[1] + radius * Math.sin(angle), center[2] + out * Math.sin(turn)]);
      const [a, b] = [i * across + j, i * across + ((j + 1) % across)];
      const next = (index) => (index + across) % (around * across);
      triangles.push([a, b, next(a)], [b, next(b), next(a)]);
    }
  }
  return { points, triangles };
}
