// What a session is doing, in one word and one sentence.

import type { Session } from '../api/messages';

export type SessionState = 'measuring' | 'behind' | 'waiting' | 'idle' | 'stored';

// Batches of which an estimator that keeps up has fewer.
const BEHIND = 8;

// Whether measurements wait to be computed.
export const isBehind = (session: Session | null): boolean => (session?.activity.unprocessedBatchCount ?? 0) >= BEHIND;

export function stateOf(session: Session): SessionState {
  const { activity } = session;
  if (isBehind(session)) return 'behind';
  if (activity.hasWriter) return session.lastSequence === 0 ? 'waiting' : 'measuring';
  if (session.lastSequence === 0) return 'waiting';
  return activity.loaded ? 'idle' : 'stored';
}

export const STATE_WORDS: Record<SessionState, { label: string; meaning: string }> = {
  measuring: { label: 'Measuring', meaning: 'A rig streams measurements to this session.' },
  behind: { label: 'Behind', meaning: 'Measurements come faster than they can be computed.' },
  waiting: { label: 'Waiting', meaning: 'No measurements have come yet.' },
  idle: { label: 'Idle', meaning: 'Nobody streams to this session now.' },
  stored: { label: 'Stored', meaning: 'The session is on disk and returns into memory when it is opened.' },
};
