// Which particles of snow lie among others, and which fly alone, as spray does.
//
// Enters: positions (m) of all particles, at each frame. Leaves: an order of a body's particles, spray last.

/** A particle is spray where it shares its cells with fewer others: snow at rest has some 16 in a whole cell. */
const FEW = 3;
/** Side of a cell over that of the cube that a particle has to itself at rest. */
const CELL = 2.5;
/** A particle at a corner of one cell is in the midst of a cell of another grid, which is shifted by half a cell. */
const SHIFTS = [0, 0.5];

/** The particles of one body. */
export class Spray {
  /** Indices over all particles of the scene: those of dense snow first. */
  readonly order: Uint32Array<ArrayBuffer>;
  private readonly cells: Int32Array;
  private readonly dense: Uint8Array;
  /** Particles of the cell at each place of the table. */
  private readonly counts: Uint32Array;
  /** A second hash, which tells cells apart that fall on one place. */
  private readonly names: Int32Array;

  /** `side` is that of the cube that a particle has to itself at rest (m). */
  constructor(private readonly first: number, private readonly count: number, private readonly side: number) {
    this.order = Uint32Array.from({ length: count }, (_, i) => first + i);
    this.cells = new Int32Array(count);
    this.dense = new Uint8Array(count);
    this.counts = new Uint32Array(2 ** Math.ceil(Math.log2(4 * count)));
    this.names = new Int32Array(this.counts.length);
  }

  /** Puts the order right for positions, x y z of all particles of the scene; how many particles are dense. */
  sort(positions: ArrayLike<number>): number {
    this.dense.fill(0);
    for (const shift of SHIFTS) this.look(positions, shift);
    let [ahead, behind] = [0, this.count];
    for (let i = 0; i < this.count; i++) {
      if (this.dense[i] === 1) this.order[ahead++] = this.first + i;
      else this.order[--behind] = this.first + i;
    }
    return ahead;
  }

  /** Marks the particles that lie among others in one grid. */
  private look(positions: ArrayLike<number>, shift: number): void {
    const { cells, counts, names, count, dense } = this;
    const [scale, last] = [1 / (CELL * this.side), counts.length - 1];
    counts.fill(0);
    for (let i = 0; i < count; i++) {
      const at = 3 * (this.first + i);
      const x = Math.floor(positions[at] * scale + shift);
      const y = Math.floor(positions[at + 1] * scale + shift);
      const z = Math.floor(positions[at + 2] * scale + shift);
      const name = Math.imul(Math.imul(Math.imul(x, 0x27d4eb2f) + y, 0x165667b1) + z, 0x9e3779b1);
      let cell = (Math.imul(x, 73856093) ^ Math.imul(y, 19349663) ^ Math.imul(z, 83492791)) & last;
      while (counts[cell] > 0 && names[cell] !== name) cell = (cell + 1) & last;
      names[cell] = name;
      cells[i] = cell;
      counts[cell] += 1;
    }
    for (let i = 0; i < count; i++) if (counts[cells[i]] > FEW) dense[i] = 1;
  }
}
