// What the colours of a picture mean, on the page.

import { type Legend, css } from './coloring.ts';

/** Shows a legend in an element, or nothing. */
export function showLegend(host: HTMLElement, legend: Legend | null): void {
  host.hidden = legend === null;
  if (legend === null) return;
  if (host.childElementCount === 0) {
    host.append(...['title', 'bar', 'labels'].map((name) => Object.assign(document.createElement('div'), { className: name })));
  }
  const [title, bar, labels] = host.children as unknown as HTMLElement[];
  title.textContent = legend.title;
  bar.style.background = `linear-gradient(to right, ${legend.colors.map(css).join(', ')})`;
  labels.replaceChildren(...legend.labels.map((label) => Object.assign(document.createElement('span'), { textContent: label })));
}
