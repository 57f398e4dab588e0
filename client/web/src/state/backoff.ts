// Pauses between attempts to reach the daemon: they double, from half a second to 20 s, and vary by
// chance so that pages do not all come at once after a restart.

const FIRST_MS = 500;
const LONGEST_MS = 20_000;

export class Backoff {
  private failures = 0;

  constructor(private readonly random: () => number = Math.random) {}

  // Returns how long to wait after another failure, ms.
  next(): number {
    const pause = Math.min(LONGEST_MS, FIRST_MS * 2 ** this.failures);
    this.failures = Math.min(this.failures + 1, 16);
    return pause * (0.75 + 0.5 * this.random());
  }

  get attempts(): number {
    return this.failures;
  }

  reset(): void {
    this.failures = 0;
  }
}

// Waits; resolves early and quietly when `stop` is aborted.
export function pause(ms: number, stop: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    if (stop.aborted) {
      resolve();
      return;
    }
    const done = (): void => {
      clearTimeout(timer);
      stop.removeEventListener('abort', done);
      resolve();
    };
    const timer = setTimeout(done, ms);
    stop.addEventListener('abort', done);
  });
}
