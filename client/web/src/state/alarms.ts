// Follows the diagnostics of successive estimates: when each began, and when it ended.

import type { Diagnostic, Estimate, HistoryPoint } from '../api/messages';

// When something happened: the time of the record and, if this page saw it, by the clock.
export interface Moment {
  time: number;
  at: Date | null;
}

export interface Alarm {
  code: string;
  messages: string[];  // none of an alarm that was over before this page looked
  began: Moment;
  beganBefore: boolean;  // it was there in the first estimate that this page knows of
  ended: Moment | null;
}

const MAX_ENDED = 20;

export class AlarmLog {
  private present = new Map<string, Alarm>();
  private past: Alarm[] = [];
  private sequence: number | null = null;  // of the last estimate known of

  // Takes the next estimate. Returns the codes that are new with it.
  update(estimate: Estimate, at = new Date()): string[] {
    const byCode = new Map<string, string[]>();
    for (const { code, message } of estimate.diagnostics) {
      byCode.set(code, [...(byCode.get(code) ?? []), message]);
    }
    return this.follow(byCode, estimate, at);
  }

  // Learns from the history of what has happened while this page did not watch.
  catchUp(points: readonly HistoryPoint[]): void {
    for (const point of points) {
      if (this.sequence !== null && point.sequence <= this.sequence) continue;
      this.follow(new Map(point.warnings.map((code) => [code, []])), point, null);
    }
  }

  // Those of the newest estimate, the latest to begin first.
  get active(): readonly Alarm[] {
    return [...this.present.values()].reverse();
  }

  // Those that are over, the latest to end first; at most the last 20.
  get ended(): readonly Alarm[] {
    return this.past;
  }

  clear(): void {
    this.present.clear();
    this.past = [];
    this.sequence = null;
  }

  private follow(byCode: ReadonlyMap<string, string[]>, { time, sequence }: { time: number; sequence: number },
                 at: Date | null): string[] {
    this.end(byCode, { time, at });
    const fresh: string[] = [];
    for (const [code, messages] of byCode) {
      const alarm = this.present.get(code);
      if (alarm) {
        if (messages.length > 0) alarm.messages = messages;
        continue;
      }
      this.present.set(code, { code, messages, began: { time, at }, beganBefore: this.sequence === null, ended: null });
      fresh.push(code);
    }
    this.sequence = sequence;
    return fresh;
  }

  private end(codes: ReadonlyMap<string, unknown>, now: Moment): void {
    for (const [code, alarm] of this.present) {
      if (codes.has(code)) continue;
      alarm.ended = now;
      this.present.delete(code);
      this.past.unshift(alarm);
    }
    this.past.length = Math.min(this.past.length, MAX_ENDED);
  }
}

// Diagnostics of an answer other than an estimate, such as a posterior.
export const codesOf = (diagnostics: readonly Diagnostic[]): string[] =>
  [...new Set(diagnostics.map(({ code }) => code))];
