// Calls of which one is under way at a time, and of those that wait only the newest is made.

export class Newest {
  private waiting: (() => Promise<void>) | null = null;
  private isBusy = false;

  /** Makes a call once the one before it is answered, unless a newer one takes its place. Calls do not fail. */
  put(call: () => Promise<void>): void {
    this.waiting = call;
    if (!this.isBusy) void this.run();
  }

  private async run(): Promise<void> {
    this.isBusy = true;
    for (let call = this.next(); call !== null; call = this.next()) await call();
    this.isBusy = false;
  }

  private next(): (() => Promise<void>) | null {
    const { waiting } = this;
    this.waiting = null;
    return waiting;
  }
}
