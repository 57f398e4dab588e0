// Runs something expensive at a low rate: one at a time, not sooner than an interval after the last
// one began, and resting ten times as long as it took. Requests in between become one.

const REST = 10;

export class PacedJob {
  private timer: ReturnType<typeof setTimeout> | null = null;
  private running = false;
  private wanted = false;
  private due = 0;
  private readonly stop = new AbortController();

  constructor(
    private readonly intervalMs: number,
    private readonly work: (stop: AbortSignal) => Promise<void>,
    private readonly now: () => number = () => performance.now(),
  ) {}

  get isRunning(): boolean {
    return this.running;
  }

  // Asks for a run when one is due.
  request(): void {
    this.wanted = true;
    this.schedule();
  }

  // Asks for a run at once.
  requestNow(): void {
    this.due = 0;
    if (this.timer !== null) clearTimeout(this.timer);
    this.timer = null;
    this.request();
  }

  dispose(): void {
    this.stop.abort();
    if (this.timer !== null) clearTimeout(this.timer);
  }

  private schedule(): void {
    if (this.running || this.timer !== null || this.stop.signal.aborted) return;
    this.timer = setTimeout(() => void this.run(), Math.max(0, this.due - this.now()));
  }

  private async run(): Promise<void> {
    this.timer = null;
    this.running = true;
    this.wanted = false;
    const began = this.now();
    try {
      await this.work(this.stop.signal);
    } finally {
      const ended = this.now();
      this.due = Math.max(began + this.intervalMs, ended + REST * (ended - began));
      this.running = false;
      if (this.wanted) this.schedule();
    }
  }
}
