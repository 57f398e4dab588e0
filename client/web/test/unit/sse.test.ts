import { describe, expect, it } from 'vitest';

import { EventParser, type ServerEvent } from '../../src/api/sse';

const all = (pieces: string[]): ServerEvent[] => {
  const parser = new EventParser();
  return pieces.flatMap((piece) => parser.push(piece));
};

describe('EventParser', () => {
  it('reads events, their types, and data of several lines', () => {
    expect(all(['data: {"a":1}\n\nevent: error\ndata: x\ndata: y\n\n'])).toEqual([
      { type: 'message', data: '{"a":1}' }, { type: 'error', data: 'x\ny' },
    ]);
  });

  it('passes over comments, unknown fields and events without data', () => {
    expect(all([': alive\n\nid: 7\nretry: 10\nevent: end\n\ndata:z\n\n'])).toEqual([{ type: 'message', data: 'z' }]);
  });

  // Wherever the network cuts the text, and whichever line ends it has, the events are the same.
  it.each(['\n', '\r\n', '\r'])('gives the same events however the text is cut (%j)', (end) => {
    const text = [': alive', '', 'data: {"k": "é…"}', '', 'event: end', 'data: {}', '', ''].join(end);
    const whole = all([text]);
    expect(whole).toEqual([{ type: 'message', data: '{"k": "é…"}' }, { type: 'end', data: '{}' }]);
    expect(all([...text])).toEqual(whole);
    for (let cut = 0; cut <= text.length; ++cut) expect(all([text.slice(0, cut), text.slice(cut)])).toEqual(whole);
  });

  it('does not give an event before its empty line', () => {
    expect(all(['data: {}\n'])).toEqual([]);
  });

  it('refuses an event that does not end', () => {
    const parser = new EventParser();
    const piece = `data: ${'x'.repeat(1 << 20)}\n`;
    expect(() => {
      for (let k = 0; k < 65; ++k) parser.push(piece);
    }).toThrow(RangeError);
  });
});
