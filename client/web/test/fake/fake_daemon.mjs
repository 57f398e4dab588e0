// A daemon that speaks the web port's contract from a recording, and fails on demand. It stands in
// for polyestd where a test needs what a real one does not do when asked to.

import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { dirname, extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const recording = JSON.parse(readFileSync(join(here, 'recording.json'), 'utf8'));
const points = recording.history.history.points;

export const POLICY =
  "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; " +
  "font-src 'self'; base-uri 'none'; frame-ancestors 'none'; form-action 'none'";

const TYPES = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml' };
const HTTP = { 3: 400, 5: 404, 7: 403, 8: 429, 9: 400, 12: 501, 13: 500, 14: 503, 16: 401 };

export class Failure extends Error {
  constructor(code, message) {
    super(message);
    this.code = code;
  }
}

// A session whose estimates are those of the recording, one after the other and over again.
class FakeSession {
  constructor(id, { count = points.length, hasWriter = false, unprocessed = 0, loaded = true } = {}) {
    this.id = id;
    this.count = count;  // estimates so far
    this.diagnostics = [];
    this.hasWriter = hasWriter;
    this.unprocessed = unprocessed;
    this.loaded = loaded;
    this.watchers = new Set();
    this.created = new Date(Date.UTC(2026, 0, 1)).toISOString();
    this.override = {};  // fields of the estimate that are another
    this.warnings = new Map();  // of past estimates by their index
  }

  point(index) {
    const lap = Math.floor(index / points.length);
    const point = points[index % points.length];
    return {
      ...point,
      timeS: point.timeS + lap * points[points.length - 1].timeS,
      sampleCount: String(Number(point.sampleCount) + lap * Number(points[points.length - 1].sampleCount)),
      sequence: String(index + 1),
      reexpansionCount: Math.floor((index + 1) / 40),
      warnings: this.warnings.get(index) ?? [],
    };
  }

  estimate() {
    if (this.count === 0) return null;
    const point = this.point(this.count - 1);
    const parameters = recording.estimate.parameters.map((parameter, i) => {
      const now = point.parameters[i];
      const contraction = now.stdDev / parameter.priorStdDev;
      return { ...parameter, ...now, map: now.mean, posteriorStdDev: now.stdDev, contraction };
    });
    const expansion = { ...recording.estimate.expansion, reexpansions: point.reexpansionCount };
    return {
      ...recording.estimate, parameters, expansion, diagnostics: this.diagnostics, time: point.timeS,
      samples: point.sampleCount, sequence: point.sequence, ...this.override,
    };
  }

  // All estimates until there are 512, then every second one, then every fourth …, and the newest.
  history() {
    let step = 1;
    while (Math.ceil(this.count / step) > 512) step *= 2;
    const kept = Array.from({ length: Math.ceil(this.count / step) }, (_, k) => k * step);
    if (this.count > 0 && kept[kept.length - 1] !== this.count - 1) kept.push(this.count - 1);
    return { history: { points: kept.map((index) => this.point(index)) } };
  }

  message(withProblem) {
    const point = this.count > 0 ? this.point(this.count - 1) : null;
    return {
      name: `sessions/${this.id}`, createTime: this.created,
      ...(withProblem ? { problem: recording.session.problem } : {}),
      ...(point ? { lastSequence: point.sequence, sampleCount: point.sampleCount, lastTimeS: point.timeS } : {}),
      activity: {
        loaded: this.loaded, hasWriter: this.hasWriter, watcherCount: this.watchers.size, realTimeFactor: 34.7,
        estimateCount: String(this.count), unprocessedBatchCount: String(this.unprocessed),
      },
    };
  }

  // Makes `count` new estimates and tells them to those who watch.
  push(count = 1) {
    for (let k = 0; k < count; ++k) {
      this.count += 1;
      if (this.diagnostics.length > 0) this.warnings.set(this.count - 1, this.diagnostics.map(({ code }) => code));
      const text = `data: ${JSON.stringify({ estimate: this.estimate() })}\n\n`;
      for (const watcher of this.watchers) watcher.write(text);
    }
  }

  end(code, message) {
    for (const watcher of this.watchers) watcher.end(`event: error\ndata: ${JSON.stringify({ code, message })}\n\n`);
    this.watchers.clear();
  }
}

export class FakeDaemon {
  constructor({ dist = join(here, '..', '..', 'dist'), tokens = null, heartbeatMs = 10_000 } = {}) {
    this.dist = dist;
    this.tokens = tokens;     // null: open to all
    this.heartbeatMs = heartbeatMs;
    this.sessions = new Map();
    this.failures = new Map();  // method → Failure
    this.requests = [];         // {method, url, authorization, at: ms}
    this.port = 0;
  }

  add(id, options) {
    const session = new FakeSession(id, options);
    this.sessions.set(id, session);
    return session;
  }

  delete(id) {
    this.sessions.get(id)?.end(5, `there is no session "sessions/${id}"`);
    this.sessions.delete(id);
  }

  // The next calls of the method fail; null: they do not any more.
  fail(method, failure) {
    if (failure) this.failures.set(method, failure);
    else this.failures.delete(method);
  }

  get address() {
    return `http://127.0.0.1:${this.port}/`;
  }

  // Listens, on the port that it had before, if it had one.
  async start(port = this.port) {
    this.sockets = new Set();
    this.server = createServer((request, answer) => this.serve(request, answer));
    this.server.on('connection', (socket) => {
      this.sockets.add(socket);
      socket.on('close', () => this.sockets.delete(socket));
    });
    await new Promise((resolve, reject) => {
      this.server.once('error', reject);
      this.server.listen(port, '127.0.0.1', resolve);
    });
    this.port = this.server.address().port;
    this.beat = setInterval(() => this.write(': alive\n\n'), this.heartbeatMs);
  }

  // Ends as if it were killed.
  async stop() {
    clearInterval(this.beat);
    for (const session of this.sessions.values()) session.watchers.clear();
    const closed = new Promise((resolve) => { this.server.close(resolve); });
    for (const socket of this.sockets) socket.destroy();
    await closed;
  }

  write(text) {
    for (const session of this.sessions.values()) {
      for (const watcher of session.watchers) watcher.write(text);
    }
  }

  async serve(request, answer) {
    const { method, url, headers } = request;
    const noted = { method, url, authorization: headers.authorization ?? null, at: performance.now(), body: null };
    this.requests.push(noted);
    if (this.requests.length > 10_000) this.requests.shift();
    answer.setHeader('Content-Security-Policy', POLICY);
    answer.setHeader('X-Content-Type-Options', 'nosniff');
    answer.setHeader('Referrer-Policy', 'no-referrer');
    answer.setHeader('Cache-Control', 'no-store');
    if (method === 'GET') {
      this.file(url, answer);
      return;
    }
    let body = '';
    for await (const piece of request) body += piece;
    try {
      noted.body = body === '' ? {} : JSON.parse(body);
      this.call(url, headers, noted.body, answer);
    } catch (failure) {
      if (!(failure instanceof Failure)) throw failure;
      this.json(answer, HTTP[failure.code] ?? 500, { code: failure.code, message: failure.message });
    }
  }

  file(url, answer) {
    const path = normalize(decodeURIComponent(url.split('?')[0])).replace(/^\/+/, '');
    try {
      const bytes = readFileSync(join(this.dist, path === '' ? 'index.html' : path));
      answer.writeHead(200, { 'Content-Type': TYPES[extname(path || '.html') || '.html'] ?? 'application/octet-stream' });
      answer.end(bytes);
    } catch {
      answer.writeHead(404, { 'Content-Type': 'text/plain' });
      answer.end('not found\n');
    }
  }

  json(answer, status, message) {
    answer.writeHead(status, { 'Content-Type': 'application/json' });
    answer.end(JSON.stringify(message));
  }

  call(url, headers, body, answer) {
    if (headers['content-type'] !== 'application/json') throw new Failure(3, 'Content-Type must be application/json');
    const origin = headers.origin;
    if (origin !== undefined && origin !== `http://${headers.host}`) throw new Failure(7, 'another origin');
    const method = url.split('/').pop();
    const failure = this.failures.get(method);
    if (failure) throw failure;
    if (this.tokens !== null && !this.tokens.includes((headers.authorization ?? '').replace(/^Bearer /, ''))) {
      throw new Failure(16, headers.authorization ? 'the token is not known' : 'a token is required');
    }
    const find = (name) => {
      const session = this.sessions.get(String(name).replace('sessions/', ''));
      if (!session) throw new Failure(5, `there is no session "${name}"`);
      return session;
    };
    switch (method) {
      case 'ListSessions': return this.json(answer, 200, this.list(body));
      case 'GetSession': return this.json(answer, 200, find(body.name).message(!body.omitProblem));
      case 'GetHistory': return this.json(answer, 200, find(body.session).history());
      case 'GetStatus': return this.json(answer, 200, { ...recording.status, sessionCount: String(this.sessions.size) });
      case 'WatchSession': return this.watch(find(body.session), answer);
      case 'GetEstimate': return this.json(answer, 200, withSamples(find(body.session)).estimate());
      case 'Predict': return this.json(answer, 200, of(recording.prediction, withSamples(find(body.subject.session))));
      case 'ComputePosterior': return this.json(answer, 200, of(recording.posterior, withSamples(find(body.subject.session))));
      default: throw new Failure(12, `there is no method ${method}`);
    }
  }

  list({ pageSize = 50, pageToken = '' }) {
    const all = [...this.sessions.values()].sort((a, b) => (a.id < b.id ? -1 : 1));
    const from = pageToken === '' ? 0 : Number(pageToken);
    const next = from + pageSize < all.length ? { nextPageToken: String(from + pageSize) } : {};
    return { sessions: all.slice(from, from + pageSize).map((session) => session.message(false)), ...next };
  }

  watch(session, answer) {
    answer.writeHead(200, { 'Content-Type': 'text/event-stream' });
    const estimate = session.estimate();
    answer.write(estimate ? `data: ${JSON.stringify({ estimate })}\n\n` : ': alive\n\n');
    session.watchers.add(answer);
    answer.on('close', () => session.watchers.delete(answer));
  }
}

// Says of which batch a recorded answer is.
function of(message, session) {
  const point = session.point(session.count - 1);
  return { ...message, sequence: point.sequence };
}

function withSamples(session) {
  if (session.count === 0) throw new Failure(9, 'the session has no samples yet');
  return session;
}

