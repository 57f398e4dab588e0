// Calls the daemon's methods: JSON over HTTP, on the address that this page came from.

import { CallError, Code, errorOfAnswer, errorOfFetch } from './errors';
import * as messages from './messages';
import { EventParser } from './sse';
import { token } from './token';

// The daemon shows a sign of life every 10 s.
const SILENCE_MS = 25_000;

// Every wait for an answer ends: a computation may take long, but not for ever.
const ANSWER_MS = 120_000;

function request(path: string, body: unknown, signal: AbortSignal): Promise<Response> {
  const headers: Record<string, string> = { 'Content-Type': 'application/json' };
  if (token() !== '') headers['Authorization'] = `Bearer ${token()}`;
  return fetch(`v1/${path}`, {
    method: 'POST', headers, body: JSON.stringify(body), signal, cache: 'no-store', credentials: 'omit',
  });
}

async function call<T>(
  path: string, body: unknown, read: (json: unknown) => T, stop?: AbortSignal,
): Promise<T> {
  const late = new AbortController();
  const timer = setTimeout(() => late.abort(), ANSWER_MS);
  const onStop = (): void => late.abort();
  stop?.addEventListener('abort', onStop);
  if (stop?.aborted) late.abort();
  try {
    const answer = await request(path, body, late.signal);
    const text = await answer.text();
    if (!answer.ok) throw errorOfAnswer(answer.status, text);
    let json: unknown;
    try {
      json = JSON.parse(text);
    } catch {
      throw new CallError(Code.INTERNAL, 'the answer cannot be read');
    }
    return read(json);
  } catch (thrown) {
    const error = errorOfFetch(thrown);
    if (error.code === Code.CANCELLED && !stop?.aborted) {
      throw new CallError(Code.DEADLINE_EXCEEDED, 'the daemon did not answer in time');
    }
    throw error;
  } finally {
    clearTimeout(timer);
    stop?.removeEventListener('abort', onStop);
  }
}

const ofSession = (session: string): { subject: { session: string } } => ({ subject: { session } });

export const listSessions = (pageSize: number, pageToken: string, stop?: AbortSignal) =>
  call('SessionService/ListSessions', { pageSize, pageToken }, messages.readSessionPage, stop);

export const getSession = (name: string, stop?: AbortSignal) =>
  call('SessionService/GetSession', { name }, messages.readSession, stop);

// Without the problem, which may be large and never changes.
export const getLoad = (name: string, stop?: AbortSignal) =>
  call('SessionService/GetSession', { name, omitProblem: true }, messages.readSession, stop);

export const getHistory = (session: string, stop?: AbortSignal) =>
  call('SessionService/GetHistory', { session }, messages.readHistory, stop);

export const getStatus = (stop?: AbortSignal) =>
  call('StatusService/GetStatus', {}, messages.readDaemonStatus, stop);

// What the daemon sent, as it is, for downloads.
export const getRaw = (path: string, body: unknown, stop?: AbortSignal) =>
  call(path, body, (json) => json, stop);

export const predict = (session: string, drawCount: number, maxRowCount: number, stop?: AbortSignal) =>
  call('StudyService/Predict', { ...ofSession(session), drawCount, maxRowCount: String(maxRowCount) },
       messages.readPrediction, stop);

export const computePosterior = (session: string, stop?: AbortSignal) =>
  call('StudyService/ComputePosterior',
       { ...ofSession(session), allJoints: true, jointBinCount: 32, densityBinCount: 64 },
       messages.readPosterior, stop);

// Passes the present estimate of a session and then new ones to `onEstimate`, and returns when the
// daemon ends the stream. `onOpen` is called when the daemon has answered. Throws a CallError when
// the stream fails, or when nothing comes for longer than the daemon's signs of life allow.
export async function watchSession(
  session: string, onOpen: () => void, onEstimate: (estimate: messages.Estimate) => void, stop: AbortSignal,
): Promise<void> {
  const silent = new AbortController();
  const abort = (): void => silent.abort();
  stop.addEventListener('abort', abort);
  if (stop.aborted) abort();
  let timer = setTimeout(abort, SILENCE_MS);
  try {
    const answer = await request('SessionService/WatchSession', { session }, silent.signal);
    if (!answer.ok || !answer.body) throw errorOfAnswer(answer.status, await answer.text());
    onOpen();
    const reader = answer.body.getReader();
    const decoder = new TextDecoder();
    const parser = new EventParser();
    for (;;) {
      const { done, value } = await reader.read();
      if (done) throw new CallError(Code.UNAVAILABLE, 'the connection broke off');
      clearTimeout(timer);
      timer = setTimeout(abort, SILENCE_MS);
      for (const event of parser.push(decoder.decode(value, { stream: true }))) {
        if (event.type === 'end') return;
        if (event.type === 'error') throw errorOfAnswer(500, event.data);
        const estimate = messages.readWatchEvent(JSON.parse(event.data));
        if (estimate) onEstimate(estimate);
      }
    }
  } catch (thrown) {
    if (thrown instanceof SyntaxError || thrown instanceof RangeError) {
      throw new CallError(Code.INTERNAL, 'the stream cannot be read');
    }
    const error = errorOfFetch(thrown);
    if (error.code === Code.CANCELLED && !stop.aborted) {
      throw new CallError(Code.UNAVAILABLE, 'nothing has come from the daemon for 25 s');
    }
    throw error;
  } finally {
    clearTimeout(timer);
    stop.removeEventListener('abort', abort);
    silent.abort();  // closes the connection if it is still open
  }
}
