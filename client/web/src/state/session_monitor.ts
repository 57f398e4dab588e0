// Watches one session: its estimates as they come, how they came about, its load. It goes on until
// it is stopped, through lost connections and restarts of the daemon.

import * as client from '../api/client';
import { CallError, Code } from '../api/errors';
import type { Estimate, Session } from '../api/messages';
import { AlarmLog } from './alarms';
import { Backoff, pause } from './backoff';
import { EstimateHistory } from './estimate_history';
import { PacedJob } from './paced_job';

export type Connection =
  | { kind: 'connecting' }
  | { kind: 'open' }
  | { kind: 'lost'; reason: string; retryAt: number }
  | { kind: 'token'; reason: string }    // none, or not the right one
  | { kind: 'refused'; reason: string }  // the token may not see this
  | { kind: 'gone' };                    // no such session, or it has been deleted

const LOAD_INTERVAL_MS = 2_000;
const HISTORY_INTERVAL_MS = 30_000;

export interface MonitorEvents {
  onChange: () => void;               // anything below is new
  onAlarms?: (codes: string[]) => void;  // these began
}

export class SessionMonitor {
  readonly name: string;
  readonly history = new EstimateHistory();
  readonly alarms = new AlarmLog();
  connection: Connection = { kind: 'connecting' };
  estimate: Estimate | null = null;
  session: Session | null = null;
  estimateCount = 0;                 // seen by this page
  estimateAt: number | null = null;  // when the newest was made, ms since 1970; null: before this page looked

  private sinceOpen = 0;             // estimates of this stream
  private readonly stopping = new AbortController();
  private retry = new AbortController();
  private readonly backoff = new Backoff();
  // A page that is slower than the estimates gets only the newest; the daemon has those between.
  private readonly rereading = new PacedJob(HISTORY_INTERVAL_MS, (stop) => this.rereadHistory(stop));

  constructor(readonly id: string, private readonly events: MonitorEvents) {
    this.name = `sessions/${id}`;
  }

  start(): void {
    void this.follow();
    void this.pollLoad();
  }

  stop(): void {
    this.stopping.abort();
    this.retry.abort();
    this.rereading.dispose();
  }

  // Does not wait any longer for the next attempt.
  retryNow(): void {
    this.retry.abort();
  }

  private get isStopped(): boolean {
    return this.stopping.signal.aborted;
  }

  private set(connection: Connection): void {
    this.connection = connection;
    if (!this.isStopped) this.events.onChange();
  }

  private async follow(): Promise<void> {
    while (!this.isStopped) {
      try {
        await this.openAndWatch();
        this.lose('the daemon ended the stream');
      } catch (thrown) {
        if (this.isStopped) return;
        if (!this.judge(thrown)) return;
      }
      await pause(this.connection.kind === 'lost' ? this.connection.retryAt - Date.now() : 0, this.retry.signal);
      this.retry = new AbortController();
    }
  }

  private async openAndWatch(): Promise<void> {
    const stop = this.stopping.signal;
    const session = await client.getSession(this.name, stop);
    if (this.session !== null && this.session.createTime !== session.createTime) this.forget();
    this.session = session;
    const points = await client.getHistory(this.name, stop);
    this.history.load(points);
    this.alarms.catchUp(points);
    await client.watchSession(this.name, () => this.onOpen(), (estimate) => this.take(estimate), stop);
  }

  private onOpen(): void {
    this.sinceOpen = 0;
    this.set({ kind: 'open' });
  }

  private take(estimate: Estimate): void {
    this.backoff.reset();
    if (estimate.samples === 0) return;  // that is the prior alone
    this.history.append(estimate);
    // What a stream begins with may be old.
    const isNew = estimate.sequence !== this.estimate?.sequence && (this.sinceOpen > 0 || this.session?.activity.hasWriter === true);
    if (this.sinceOpen > 0 && estimate.sequence > (this.estimate?.sequence ?? 0) + 1) this.rereading.request();
    this.sinceOpen += 1;
    this.estimate = estimate;
    if (isNew) this.estimateAt = Date.now();
    this.estimateCount += 1;
    const fresh = this.alarms.update(estimate);
    if (fresh.length > 0) this.events.onAlarms?.(fresh);
    this.events.onChange();
  }

  private async rereadHistory(stop: AbortSignal): Promise<void> {
    try {
      const points = await client.getHistory(this.name, stop);
      if (this.connection.kind !== 'open') return;
      this.history.load(points);
      if (this.estimate) this.history.append(this.estimate);  // it may be newer than the answer
    } catch {
      // The history stays as this page has seen it.
    }
  }

  // Begins anew: another session has the name.
  private forget(): void {
    this.estimate = null;
    this.history.restart();
    this.alarms.clear();
  }

  // Says what an error means for the connection. Returns whether to try again.
  private judge(thrown: unknown): boolean {
    const error = thrown instanceof CallError ? thrown : new CallError(Code.UNKNOWN, String(thrown));
    switch (error.code) {
      case Code.NOT_FOUND:
        this.set({ kind: 'gone' });
        return false;
      case Code.UNAUTHENTICATED:
        this.set({ kind: 'token', reason: error.message });
        return false;
      case Code.PERMISSION_DENIED:
        this.set({ kind: 'refused', reason: error.message });
        return false;
      default:
        this.lose(error.message);
        return true;
    }
  }

  private lose(reason: string): void {
    this.set({ kind: 'lost', reason, retryAt: Date.now() + this.backoff.next() });
  }

  // The load is asked for while the stream is open; its errors show in the stream, too.
  private async pollLoad(): Promise<void> {
    while (!this.isStopped) {
      await pause(LOAD_INTERVAL_MS, this.stopping.signal);
      if (this.isStopped || this.connection.kind !== 'open' || document.hidden) continue;
      try {
        const load = await client.getLoad(this.name, this.stopping.signal);
        this.session = { ...load, problem: this.session?.problem ?? null };
        this.events.onChange();
      } catch {
        // The stream says what is wrong.
      }
    }
  }
}
