// Why a call failed, in the terms of google.rpc.Code; and whether trying again may help.

export const Code = {
  CANCELLED: 1,
  UNKNOWN: 2,
  INVALID_ARGUMENT: 3,
  DEADLINE_EXCEEDED: 4,
  NOT_FOUND: 5,
  PERMISSION_DENIED: 7,
  RESOURCE_EXHAUSTED: 8,
  FAILED_PRECONDITION: 9,
  ABORTED: 10,
  UNIMPLEMENTED: 12,
  INTERNAL: 13,
  UNAVAILABLE: 14,
  UNAUTHENTICATED: 16,
} as const;

export class CallError extends Error {
  constructor(readonly code: number, message: string) {
    super(message);
    this.name = 'CallError';
  }
}

// Where an answer has no Status: what its HTTP status means.
function codeOfHttp(status: number): number {
  switch (status) {
    case 400: return Code.INVALID_ARGUMENT;
    case 401: return Code.UNAUTHENTICATED;
    case 403: return Code.PERMISSION_DENIED;
    case 404: return Code.NOT_FOUND;
    case 429: return Code.RESOURCE_EXHAUSTED;
    case 501: return Code.UNIMPLEMENTED;
    case 502: case 503: return Code.UNAVAILABLE;
    case 504: return Code.DEADLINE_EXCEEDED;
    default: return Code.UNKNOWN;
  }
}

// Reads the error of an answer from its body, a google.rpc.Status in JSON.
export function errorOfAnswer(status: number, body: string): CallError {
  try {
    const json: unknown = JSON.parse(body);
    if (typeof json === 'object' && json !== null) {
      const { code, message } = json as { code?: unknown; message?: unknown };
      if (typeof code === 'number') {
        return new CallError(code, typeof message === 'string' && message !== '' ? message : `error ${code}`);
      }
    }
  } catch {
    // The answer is not the daemon's but, for example, a proxy's.
  }
  return new CallError(codeOfHttp(status), `the daemon answered with HTTP status ${status}`);
}

// Turns whatever fetch() threw into a CallError.
export function errorOfFetch(thrown: unknown): CallError {
  if (thrown instanceof CallError) return thrown;
  if (thrown instanceof DOMException && thrown.name === 'AbortError') {
    return new CallError(Code.CANCELLED, 'cancelled');
  }
  return new CallError(Code.UNAVAILABLE, 'the daemon cannot be reached');
}
