// Parses server-sent events from the pieces of text in which they arrive.
// (The event-stream format: https://html.spec.whatwg.org/multipage/server-sent-events.html)

export interface ServerEvent {
  type: string;  // "message" where the server names none
  data: string;
}

// The most characters that an event may have: a stream that never ends an event must not fill the
// memory.
export const MAX_EVENT_LENGTH = 64 * 1024 * 1024;

export class EventParser {
  private rest = '';
  private type = '';
  private data: string[] = [];
  private length = 0;
  private afterCarriageReturn = false;

  // Returns the events that `piece` completes. Throws RangeError if an event is too long.
  push(piece: string): ServerEvent[] {
    const events: ServerEvent[] = [];
    let text = piece;
    if (this.afterCarriageReturn && text.startsWith('\n')) text = text.slice(1);
    if (text !== '') this.afterCarriageReturn = text.endsWith('\r');
    this.rest += text;
    const lines = this.rest.split(/\r\n|\r|\n/);
    this.rest = lines.pop() ?? '';
    for (const line of lines) {
      const event = this.line(line);
      if (event) events.push(event);
    }
    if (this.length + this.rest.length > MAX_EVENT_LENGTH) throw new RangeError('an event is too long');
    return events;
  }

  private line(line: string): ServerEvent | null {
    if (line === '') return this.dispatch();
    if (line.startsWith(':')) return null;  // a comment, such as the sign of life
    const colon = line.indexOf(':');
    const field = colon < 0 ? line : line.slice(0, colon);
    const value = colon < 0 ? '' : line.slice(colon + 1).replace(/^ /, '');
    if (field === 'data') {
      this.data.push(value);
      this.length += value.length;
    } else if (field === 'event') {
      this.type = value;
    }
    return null;
  }

  private dispatch(): ServerEvent | null {
    const event = this.data.length > 0 ? { type: this.type || 'message', data: this.data.join('\n') } : null;
    this.type = '';
    this.data = [];
    this.length = 0;
    return event;
  }
}
