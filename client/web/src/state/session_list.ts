// The list of all sessions, refreshed as often as its size allows.

import * as client from '../api/client';
import { CallError } from '../api/errors';
import type { Session } from '../api/messages';
import { Backoff, pause } from './backoff';

const PAGE_SIZE = 200;
const MAX_PAGES = 50;  // 10,000 sessions, as many as a daemon keeps by default
const INTERVAL_MS = 2_000;
const REST = 20;       // pauses ÷ the time that a refresh takes, at least

export class SessionList {
  sessions: Session[] | null = null;  // null: not known yet
  error: CallError | null = null;     // of the last attempt
  isCut = false;                      // whether there are more than are listed

  private readonly stopping = new AbortController();
  private retry = new AbortController();
  private readonly backoff = new Backoff();

  constructor(private readonly onChange: () => void) {}

  start(): void {
    void this.run();
  }

  stop(): void {
    this.stopping.abort();
    this.retry.abort();
  }

  retryNow(): void {
    this.retry.abort();
  }

  private async run(): Promise<void> {
    while (!this.stopping.signal.aborted) {
      const began = performance.now();
      if (!document.hidden) await this.refresh();
      const took = performance.now() - began;
      const ms = this.error ? this.backoff.next() : Math.max(INTERVAL_MS, REST * took);
      await pause(ms, this.retry.signal);
      if (!this.stopping.signal.aborted) this.retry = new AbortController();
    }
  }

  private async refresh(): Promise<void> {
    const stop = this.stopping.signal;
    try {
      const sessions: Session[] = [];
      let token = '';
      let pages = 0;
      do {
        const page = await client.listSessions(PAGE_SIZE, token, stop);
        sessions.push(...page.sessions);
        token = page.nextPageToken;
        pages += 1;
      } while (token !== '' && pages < MAX_PAGES);
      this.sessions = sessions;
      this.isCut = token !== '';
      this.error = null;
      this.backoff.reset();
    } catch (thrown) {
      if (stop.aborted) return;
      this.error = thrown instanceof CallError ? thrown : new CallError(2, String(thrown));
    }
    this.onChange();
  }
}
