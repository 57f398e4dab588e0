// Follows the diagnostics of successive estimates: when each began, and when it ended.

import type { Diagnostic, Estimate } from '../api/messages';

export interface Alarm {
  code: string;
  messages: string[];
  began: { time: number; at: Date };
  beganBefore: boolean;  // it was there when this page first looked
  ended: { time: number; at: Date } | null;
}

const MAX_ENDED = 20;

export class AlarmLog {
  private present = new Map<string, Alarm>();
  private past: Alarm[] = [];
  private isFirst = true;

  // Takes the next estimate. Returns the codes that are new with it.
  update(estimate: Estimate, at = new Date()): string[] {
    const byCode = new Map<string, string[]>();
    for (const { code, message } of estimate.diagnostics) {
      byCode.set(code, [...(byCode.get(code) ?? []), message]);
    }
    this.end(byCode, { time: estimate.time, at });
    const fresh: string[] = [];
    for (const [code, messages] of byCode) {
      const alarm = this.present.get(code);
      if (alarm) {
        alarm.messages = messages;
        continue;
      }
      const began = { time: estimate.time, at };
      this.present.set(code, { code, messages, began, beganBefore: this.isFirst, ended: null });
      fresh.push(code);
    }
    this.isFirst = false;
    return fresh;
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
    this.isFirst = true;
  }

  private end(codes: ReadonlyMap<string, unknown>, now: { time: number; at: Date }): void {
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
