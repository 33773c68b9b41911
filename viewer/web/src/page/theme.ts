// Light or dark: as the browser prefers it, until the reader chooses.

export type Theme = 'light' | 'dark';

const LIGHT = '(prefers-color-scheme: light)';

export class Themes {
  private readonly light = matchMedia(LIGHT);
  private chosen: Theme | null = null;
  private readonly hears: ((theme: Theme) => void)[] = [];

  /** Gives the page its colours at once. */
  constructor() {
    this.light.addEventListener('change', () => this.apply());
    this.apply();
  }

  get theme(): Theme {
    return this.chosen ?? (this.light.matches ? 'light' : 'dark');
  }

  /** Calls it now and after each change. */
  follow(hear: (theme: Theme) => void): void {
    this.hears.push(hear);
    hear(this.theme);
  }

  toggle(): void {
    this.chosen = this.theme === 'light' ? 'dark' : 'light';
    this.apply();
  }

  private apply(): void {
    document.documentElement.dataset['theme'] = this.theme;
    for (const hear of this.hears) hear(this.theme);
  }
}
