// Keys, and buttons that do the same; panels that a button opens.

import { element } from './dom.ts';

/** What a key does; letters are small. */
export type Actions = Record<string, () => void>;

/** Buttons by the key that does the same; one without an action is disabled. */
export function wireButtons(buttons: Readonly<Record<string, string>>, actions: Actions): void {
  for (const [id, key] of Object.entries(buttons)) {
    const button = element<HTMLButtonElement>(id);
    button.disabled = actions[key] === undefined;
    button.addEventListener('click', () => actions[key]?.());
  }
}

/** Keys with `Shift` before an arrow's name stand for both together. */
export function listen(actions: Actions): void {
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const target = event.target as HTMLElement;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    // A list and a text need their own keys, and so does the help; a button is pressed by space, and a slider of a sheet goes by these.
    if (target.closest('.sheet input') !== null && /^(Arrow|Page|Home|End)/.test(key)) return;
    if (target.closest('select, pre, input:not([type="range"])') !== null || (element<HTMLDialogElement>('help').open && key !== 'h')) return;
    if (key === ' ' && target.closest('button, summary, a') !== null) return;

    // A key that is held does not switch to and fro.
    if (key === ' ' && event.repeat) return event.preventDefault();
    const action = actions[event.shiftKey && key.startsWith('Arrow') ? `Shift ${key}` : key];
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}

/** A button that opens what lies beside it, until something else is pressed. */
export function popup(opener: string, panel: string): void {
  const open = (isOpen: boolean) => {
    element(panel).classList.toggle('open', isOpen);
    element(opener).setAttribute('aria-expanded', String(isOpen));
  };
  element(opener).addEventListener('click', () => open(!element(panel).classList.contains('open')));
  document.addEventListener('pointerdown', (event) => {
    const target = event.target as Element;
    if (target.closest(`#${panel}, #${opener}`) === null) open(false);
  });
  document.addEventListener('keydown', (event) => {
    if (event.key === 'Escape') open(false);
  });
}

/** What a page says of itself: a sheet that a button opens and closes, as do Escape and a button of the sheet. */
export function sheet(opener: string, panel: string, closer: string): void {
  const open = (isOpen: boolean) => {
    element(panel).classList.toggle('open', isOpen);
    element(opener).setAttribute('aria-expanded', String(isOpen));
  };
  const close = () => {
    if (!element(panel).classList.contains('open')) return;
    open(false);
    element(opener).focus();
  };
  element(opener).addEventListener('click', () => open(!element(panel).classList.contains('open')));
  element(closer).addEventListener('click', close);
  document.addEventListener('keydown', (event) => {
    if (event.key === 'Escape' && !element<HTMLDialogElement>('help').open) close();
  });
}

export function press(id: string, pressed: boolean): void {
  element(id).setAttribute('aria-pressed', String(pressed));
}

/** Chooses the next of a list, or the one before. */
export function choose(id: string, by: number): void {
  const select = element<HTMLSelectElement>(id);
  select.selectedIndex = Math.min(Math.max(select.selectedIndex + by, 0), select.options.length - 1);
  select.dispatchEvent(new Event('change'));
}
