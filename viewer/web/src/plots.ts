// Plots over time: energies, the largest stretch, the time step, with a line at the time that is shown.
//
// Enters: diagnostics of each frame. Leaves: plots in an element; a click or a drag asks for a frame.

import uPlot from 'uplot';
import { css } from './coloring.ts';
import type { Diagnostics } from './scene.ts';

interface Series {
  label: string;
  color: readonly [number, number, number];
  value: (diagnostics: Diagnostics) => number | null;
}

interface Plot {
  title: string;
  series: Series[];
}

const PLOTS: readonly Plot[] = [
  {
    title: 'Energy (J)',
    series: [
      { label: 'kinetic', color: [232, 93, 79], value: (d) => d.kinetic },
      { label: 'elastic', color: [86, 156, 230], value: (d) => d.elastic },
      { label: 'gravitational', color: [110, 190, 120], value: (d) => d.gravitational },
      { label: 'total', color: [225, 225, 225], value: total },
    ],
  },
  { title: 'Largest stretch (1)', series: [{ label: 'stretch', color: [240, 180, 70], value: (d) => d.stretch }] },
  { title: 'Time step (ms)', series: [{ label: 'dt', color: [70, 190, 190], value: (d) => (d.dt === null ? null : 1e3 * d.dt) }] },
];

function total({ kinetic, elastic, gravitational }: Diagnostics): number | null {
  return kinetic === null || elastic === null || gravitational === null ? null : kinetic + elastic + gravitational;
}

const AXIS_COLOR = '#98a1af';
const GRID_COLOR = 'rgb(255 255 255 / 0.07)';
const HEIGHT = 150;

/** A plot that is on the page. */
interface Drawn {
  plot: uPlot;
  cursor: HTMLElement;
  /** Where the values at the cursor stand, and the series' values. */
  values: { element: HTMLElement; numbers: (number | null)[] }[];
}

export class Plots {
  private readonly drawn: Drawn[] = [];
  private readonly times: number[];
  private index = 0;

  /** Plots of which no frame has a value are left out. */
  constructor(private readonly host: HTMLElement, diagnostics: readonly Diagnostics[], private readonly seek: (time: number) => void) {
    this.times = diagnostics.map(({ time }) => time);
    for (const { title, series } of PLOTS) {
      const known = series.filter(({ value }) => diagnostics.some((d) => value(d) !== null));
      if (known.length > 0) this.drawn.push(this.build(title, known, diagnostics));
    }
    new ResizeObserver(() => this.resize()).observe(host);
  }

  get isEmpty(): boolean {
    return this.drawn.length === 0;
  }

  /** Moves the line to a frame. */
  show(index: number): void {
    this.index = index;
    for (const { plot, cursor, values } of this.drawn) {
      const left = plot.valToPos(this.times[index], 'x');
      cursor.style.transform = `translateX(${left}px)`;
      for (const { element, numbers } of values) element.textContent = readable(numbers[index]);
    }
  }

  private build(title: string, series: Series[], diagnostics: readonly Diagnostics[]): Drawn {
    const figure = append(this.host, 'figure', 'plot');
    const caption = append(figure, 'figcaption');
    append(caption, 'strong').textContent = title;
    const values = series.map(({ label, color, value }) => {
      const item = append(caption, 'span', 'series');
      append(item, 'i').style.background = css(color);
      append(item, 'span').textContent = label;
      return { element: append(item, 'b'), numbers: diagnostics.map(value) };
    });

    const axis = { stroke: AXIS_COLOR, font: '11px system-ui, sans-serif', grid: { stroke: GRID_COLOR, width: 1 }, ticks: { show: false } };
    const plot = new uPlot(
      {
        width: Math.max(200, this.host.clientWidth),
        height: HEIGHT,
        legend: { show: false },
        cursor: { drag: { x: false, y: false }, y: false, points: { show: false } },
        scales: { x: { time: false } },
        axes: [
          { ...axis, size: 26, values: (_, ticks) => ticks.map((tick) => `${readable(tick)} s`) },
          { ...axis, size: 56, values: (_, ticks) => ticks.map(readable) },
        ],
        series: [
          {},
          ...series.map(({ label, color }) => ({ label, stroke: css(color), width: 1.5, points: { show: diagnostics.length === 1 } })),
        ],
        hooks: { draw: [() => this.show(this.index)] },
      },
      [this.times, ...values.map(({ numbers }) => numbers)] as uPlot.AlignedData,
      figure,
    );
    this.listen(plot);
    return { plot, cursor: append(plot.over, 'div', 'now'), values };
  }

  private listen(plot: uPlot): void {
    const ask = (event: PointerEvent) => this.seek(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, 'x'));
    plot.over.addEventListener('pointerdown', (event) => {
      plot.over.setPointerCapture(event.pointerId);
      ask(event);
    });
    plot.over.addEventListener('pointermove', (event) => {
      if (plot.over.hasPointerCapture(event.pointerId)) ask(event);
    });
  }

  private resize(): void {
    const width = this.host.clientWidth;
    // A closed panel has no width.
    if (width === 0) return;
    for (const { plot } of this.drawn) {
      if (plot.width !== width) plot.setSize({ width, height: HEIGHT });
    }
  }
}

function append<K extends keyof HTMLElementTagNameMap>(parent: HTMLElement, tag: K, name = ''): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (name !== '') element.className = name;
  parent.append(element);
  return element;
}

/** A number of at most four digits. */
function readable(number: number | null | undefined): string {
  if (number === null || number === undefined) return '';
  const size = Math.abs(number);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) return number.toExponential(1);
  return String(Number(number.toPrecision(4)));
}
