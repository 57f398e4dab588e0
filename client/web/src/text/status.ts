// What a session is doing, as its page says it.

import type { SessionMonitor } from '../state/session_monitor';
import { stateOf } from '../state/session_state';
import { duration } from './number';

export interface Status {
  tone: 'live' | 'quiet' | 'trouble';
  label: string;
  detail: string;
  hasRetry: boolean;
}

// Why what is expensive is not computed now.
export const WAITS = 'Waits until the daemon has computed the measurements that it has.';

// Estimates that come later than this after the last one are no stream, s.
const FRESH_S = 5;

type Watched = Pick<SessionMonitor, 'connection' | 'estimate' | 'estimateAt' | 'session' | 'id'>;

export function statusOf(watched: Watched, now = Date.now()): Status {
  const { connection } = watched;
  switch (connection.kind) {
    case 'connecting':
      return { tone: 'quiet', label: 'Connecting', detail: '', hasRetry: false };
    case 'lost': {
      const left = Math.max(0, Math.ceil((connection.retryAt - now) / 1000));
      const detail = `${sentence(connection.reason)} Trying again ${left > 0 ? `in ${left} s` : 'now'}.`;
      return { tone: 'trouble', label: 'Stream lost', detail, hasRetry: true };
    }
    case 'gone':
      return { tone: 'trouble', label: 'Deleted', detail: `There is no session ${watched.id} any more.`, hasRetry: false };
    case 'token': case 'refused':
      return { tone: 'trouble', label: 'No access', detail: sentence(connection.reason), hasRetry: true };
    case 'open':
      return statusOfOpen(watched, now);
  }
}

function statusOfOpen({ estimate, estimateAt, session }: Watched, now: number): Status {
  if (!estimate) {
    const hasData = (session?.lastSequence ?? 0) > 0;
    return hasData
      ? { tone: 'quiet', label: 'No estimate yet', detail: 'Measurements have come; the daemon is computing, or brings the session back from disk.', hasRetry: false }
      : { tone: 'quiet', label: 'Waiting for data', detail: 'No measurements have come yet.', hasRetry: false };
  }
  if (estimateAt === null && session?.activity.hasWriter !== true) {
    return { tone: 'quiet', label: 'Idle', detail: 'Nobody streams to this session now.', hasRetry: false };
  }
  const age = estimateAt === null ? Infinity : (now - estimateAt) / 1000;
  if (age < FRESH_S) return { tone: 'live', label: 'Live', detail: '', hasRetry: false };
  if (session && stateOf(session) === 'behind') {
    return { tone: 'trouble', label: 'Behind', detail: `No new estimate for ${duration(age)}; batches wait to be computed.`, hasRetry: false };
  }
  return { tone: 'quiet', label: 'No new data', detail: Number.isFinite(age) ? `The last estimate came ${duration(age)} ago.` : '', hasRetry: false };
}

function sentence(text: string): string {
  const capital = text.replace(/^./, (c) => c.toUpperCase());
  return /[.!?]$/.test(capital) ? capital : `${capital}.`;
}
