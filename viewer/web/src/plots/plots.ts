// Plots over time: energies, the largest stretch, the time step, with a line at the time that is shown.
//
// Enters: diagnostics of each frame, which may be others later. Leaves: plots in an element; a click or a drag asks for a
// frame, if any can be asked for.

import uPlot from 'uplot';
import { type Axis, isWide, linear, logarithmic } from './axis.ts';
import { readable } from '../page/numbers.ts';
import type { Diagnostics } from '../scene.ts';

interface Series {
  label: string;
  /** Name of its colour in the style sheet. */
  color: string;
  /** Pixels drawn and left out, in turn: lines differ also where colours look alike. */
  dash: number[];
  value: (diagnostics: Diagnostics) => number | null;
}

interface Quantity {
  title: string;
  series: Series[];
}

const QUANTITIES: readonly Quantity[] = [
  {
    title: 'Energy (J)',
    series: [
      { label: 'kinetic', color: '--kinetic', dash: [], value: (d) => d.kinetic },
      { label: 'elastic', color: '--elastic', dash: [7, 3], value: (d) => d.elastic },
      { label: 'gravitational', color: '--gravitational', dash: [2, 3], value: (d) => d.gravitational },
      { label: 'total', color: '--total', dash: [10, 3, 2, 3], value: total },
    ],
  },
  { title: 'Largest stretch (1)', series: [{ label: 'stretch', color: '--stretch', dash: [], value: (d) => d.stretch }] },
  {
    title: 'Time step (ms)',
    series: [{ label: 'dt', color: '--dt', dash: [], value: (d) => (d.dt === null ? null : 1e3 * d.dt) }],
  },
];

function total({ kinetic, elastic, gravitational }: Diagnostics): number | null {
  return kinetic === null || elastic === null || gravitational === null ? null : kinetic + elastic + gravitational;
}

const SVG = 'http://www.w3.org/2000/svg';
/** Height of a plot, the least that it shrinks to where all are to fit, and width of what is beside its axis, over the size of the text. */
const HEIGHT = 11;
const LEAST_HEIGHT = 7;
const BESIDE = 4;
/** What is left below the plots: numbers above them may take another line. */
const SPARE = 1.5;

/** A plot that is on the page. */
interface Drawn {
  title: string;
  figure: HTMLElement;
  series: { of: Series; numbers: (number | null)[]; shown: HTMLElement }[];
  isLogarithmic: boolean;
  axis: Axis;
  plot: uPlot | null;
  cursor: HTMLElement | null;
}

export class Plots {
  private drawn: Drawn[];
  private times: number[];
  private index = 0;
  private textSize = 0;
  /** Of each plot (pixels). */
  private height = 0;

  /** Plots of which no frame has a value are left out. `seek` is null where only the newest frame can be shown. */
  constructor(private readonly host: HTMLElement, diagnostics: readonly Diagnostics[], private readonly seek: ((time: number) => void) | null) {
    this.times = diagnostics.map(({ time }) => time);
    this.drawn = QUANTITIES.flatMap((quantity) => this.figure(quantity, diagnostics));
    const observer = new ResizeObserver(() => this.resize());
    observer.observe(host);
    const panel = host.closest('.side');
    if (panel !== null) observer.observe(panel);
  }

  /** Shows these from now on, up to the last of them. */
  replace(diagnostics: readonly Diagnostics[]): void {
    this.times = diagnostics.map(({ time }) => time);
    const known = QUANTITIES.map(({ series }) => knownOf(series, diagnostics)).filter((series) => series.length > 0).flat();
    const shown = this.drawn.flatMap(({ series }) => series.map(({ of }) => of));
    if (known.length !== shown.length || known.some((series, at) => series !== shown[at])) {
      for (const { plot, figure } of this.drawn) {
        plot?.destroy();
        figure.remove();
      }
      this.drawn = QUANTITIES.flatMap((quantity) => this.figure(quantity, diagnostics));
      this.redraw();
    }
    for (const drawn of this.drawn) {
      for (const series of drawn.series) series.numbers = diagnostics.map(series.of.value);
      drawn.axis = axisOf(drawn);
      drawn.plot?.setData(this.data(drawn));
      drawn.plot?.root.setAttribute('aria-label', this.inWords(drawn));
    }
    this.show(diagnostics.length - 1);
  }

  get isEmpty(): boolean {
    return this.drawn.length === 0;
  }

  /** Moves the line to a frame. */
  show(index: number): void {
    this.index = index;
    for (const drawn of this.drawn) {
      this.moveCursor(drawn);
      for (const { shown, numbers } of drawn.series) shown.textContent = readable(numbers[index]);
    }
  }

  /** Draws all anew, since colours or sizes are others. */
  redraw(): void {
    this.textSize = parseFloat(getComputedStyle(document.documentElement).fontSize);
    this.height = this.heightOf();
    for (const drawn of this.drawn) this.draw(drawn);
  }

  /** What stands around a plot; nothing if no frame has a value. */
  private figure({ title, series }: Quantity, diagnostics: readonly Diagnostics[]): Drawn[] {
    const known = knownOf(series, diagnostics);
    if (known.length === 0) return [];
    const figure = append(this.host, 'figure', 'plot');
    const caption = append(figure, 'figcaption');
    append(caption, 'strong').textContent = title;
    const button = append(caption, 'button', 'scale');
    const keys = append(caption, 'span', 'keys');
    const shown = known.map((of) => {
      const item = append(keys, 'span', 'series');
      item.append(sample(of.color, of.dash));
      append(item, 'span').textContent = of.label;
      return { of, numbers: diagnostics.map(of.value), shown: append(item, 'b') };
    });

    const isLogarithmic = isWide(shown.map(({ numbers }) => numbers));
    const axis = axisOf({ series: shown, isLogarithmic });
    const drawn: Drawn = { title, figure, series: shown, isLogarithmic, axis, plot: null, cursor: null };
    Object.assign(button, { type: 'button', textContent: 'log', title: 'Equal ratios are equally long' });
    button.setAttribute('aria-label', `${title}: logarithmic axis`);
    const press = () => button.setAttribute('aria-pressed', String(drawn.isLogarithmic));
    button.addEventListener('click', () => {
      drawn.isLogarithmic = !drawn.isLogarithmic;
      press();
      this.draw(drawn);
    });
    press();
    return [drawn];
  }

  private draw(drawn: Drawn): void {
    drawn.plot?.destroy();
    drawn.plot = drawn.cursor = null;
    const width = this.host.clientWidth;
    // A closed panel has no width.
    if (width === 0) return;

    drawn.axis = axisOf(drawn);
    const plot = new uPlot(this.options(drawn, width), this.data(drawn), drawn.figure);
    plot.root.setAttribute('role', 'img');
    plot.root.setAttribute('aria-label', this.inWords(drawn));
    drawn.plot = plot;
    if (this.seek === null) return;
    this.listen(plot, this.seek);
    drawn.cursor = append(plot.over, 'div', 'now');
    this.moveCursor(drawn);
  }

  private data({ series, axis }: Drawn): uPlot.AlignedData {
    const places = series.map(({ numbers }) => numbers.map((number) => (number === null ? null : axis.place(number))));
    return [this.times, ...places] as uPlot.AlignedData;
  }

  /** The axis is asked for anew with other data. */
  private options(drawn: Drawn, width: number): uPlot.Options {
    const style = getComputedStyle(document.documentElement);
    const color = (name: string) => style.getPropertyValue(name).trim();
    const rem = this.textSize;
    const axis = {
      stroke: color('--dim'), font: `${0.8 * rem}px system-ui, sans-serif`, ticks: { show: false },
      grid: { stroke: color('--grid'), width: 1 },
    };
    return {
      width,
      height: this.height,
      legend: { show: false },
      cursor: { drag: { x: false, y: false }, y: false, points: { show: false } },
      scales: { x: { time: false }, y: { range: () => drawn.axis.range } },
      axes: [
        { ...axis, size: 1.9 * rem, values: (_, times) => times.map((time) => `${readable(time)} s`) },
        {
          ...axis, size: BESIDE * rem, splits: () => drawn.axis.ticks.map(({ at }) => at),
          values: () => drawn.axis.ticks.map(({ label }) => label),
        },
      ],
      series: [
        {},
        ...drawn.series.map(({ of: { label, color: name, dash } }) => (
          { label, stroke: color(name), dash, width: rem / 8, points: { show: () => this.times.length === 1 } }
        )),
      ],
    };
  }

  /** What a plot shows, for who does not see it. */
  private inWords({ title, series, isLogarithmic }: Drawn): string {
    const ranges = series.map(({ of: { label }, numbers }) => {
      const all = finite(numbers);
      const [least, most] = all.reduce(([a, b], number) => [Math.min(a, number), Math.max(b, number)], [Infinity, -Infinity]);
      return `${label} from ${readable(least)} to ${readable(most)}`;
    });
    const [first, last] = [this.times[0], this.times[this.times.length - 1]];
    const scale = isLogarithmic ? ', logarithmic' : '';
    return `${title}${scale}, over time from ${readable(first)} to ${readable(last)} s: ${ranges.join('; ')}`;
  }

  private moveCursor({ plot, cursor }: Drawn): void {
    if (plot === null || cursor === null) return;
    cursor.style.transform = `translateX(${plot.valToPos(this.times[this.index], 'x')}px)`;
  }

  private listen(plot: uPlot, seek: (time: number) => void): void {
    const ask = (event: PointerEvent) => seek(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, 'x'));
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
    const textSize = parseFloat(getComputedStyle(document.documentElement).fontSize);
    const isOther = ({ plot }: Drawn) => plot?.width !== width || textSize !== this.textSize;
    if (width > 0 && (this.drawn.some(isOther) || this.heightOf() !== this.height)) this.redraw();
  }

  /** Height of each plot (pixels), so that all of them fit into a panel beside the picture; one below it scrolls. */
  private heightOf(): number {
    const rem = parseFloat(getComputedStyle(document.documentElement).fontSize);
    const panel = this.host.closest('.side');
    if (panel === null || this.drawn.length === 0 || getComputedStyle(panel).maxHeight !== 'none') return HEIGHT * rem;
    const above = this.host.getBoundingClientRect().top - panel.getBoundingClientRect().top + panel.scrollTop;
    const words = this.drawn.reduce((sum, { figure }) => sum + wordsOf(figure), 0);
    const each = Math.floor((panel.clientHeight - above - words - SPARE * rem) / this.drawn.length);
    return Math.min(Math.max(each, LEAST_HEIGHT * rem), HEIGHT * rem);
  }
}

/** Height of what stands around a plot, with the space between it and others (pixels). */
function wordsOf(figure: HTMLElement): number {
  const { marginTop, marginBottom } = getComputedStyle(figure);
  const caption = figure.querySelector('figcaption');
  const below = caption === null ? 0 : caption.offsetHeight + parseFloat(getComputedStyle(caption).marginBottom);
  return below + parseFloat(marginTop) + parseFloat(marginBottom);
}

/** Those of which some frame has a value. */
const knownOf = (series: readonly Series[], diagnostics: readonly Diagnostics[]): Series[] =>
  series.filter(({ value }) => diagnostics.some((d) => value(d) !== null));

function axisOf({ series, isLogarithmic }: Pick<Drawn, 'series' | 'isLogarithmic'>): Axis {
  const all = series.flatMap(({ numbers }) => finite(numbers));
  return isLogarithmic ? logarithmic(all) : linear(all);
}

/** A line as the plot draws it. */
function sample(color: string, dash: number[]): SVGSVGElement {
  const svg = document.createElementNS(SVG, 'svg');
  svg.setAttribute('viewBox', '0 0 24 4');
  svg.setAttribute('aria-hidden', 'true');
  const line = document.createElementNS(SVG, 'line');
  const attributes = { x1: 0, x2: 24, y1: 2, y2: 2, 'stroke-width': 2.5, 'stroke-dasharray': dash.join(' ') };
  for (const [name, value] of Object.entries(attributes)) line.setAttribute(name, String(value));
  line.style.stroke = `var(${color})`;
  svg.append(line);
  return svg;
}

const finite = (numbers: readonly (number | null)[]): number[] => numbers.filter((number) => number !== null && Number.isFinite(number)) as number[];

function append<K extends keyof HTMLElementTagNameMap>(parent: HTMLElement, tag: K, name = ''): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (name !== '') element.className = name;
  parent.append(element);
  return element;
}
