// A problem as text: its JSON, with short parts on one line, long lists and contents shortened, and
// without what the daemon writes for fields that nobody has set.

import { whole } from './number';

const LINE = 100;           // characters
const MAX_NUMBERS = 20;     // of a list that is written out
const MAX_CHARACTERS = 400; // of a text that is written out: equations are, contents of files are not

const isObject = (value: unknown): value is { [key: string]: unknown } => typeof value === 'object' && value !== null;

// Whether a field says nothing. Zeros, false and empty objects stay: they may be choices.
function isUnset(value: unknown): boolean {
  if (typeof value === 'string') return value === '' || value.endsWith('_UNSPECIFIED');
  return Array.isArray(value) && value.length === 0;
}

function shortened(value: unknown): string | null {
  if (typeof value === 'string' && value.length > MAX_CHARACTERS) {
    return `${JSON.stringify(value.slice(0, 40)).slice(0, -1)}…" (${whole(value.length)} characters)`;
  }
  const isLong = Array.isArray(value) && value.length > MAX_NUMBERS && value.every((each) => !isObject(each));
  if (!isLong) return null;
  return `[${value.slice(0, 3).map((each) => JSON.stringify(each)).join(', ')}, … ${JSON.stringify(value[value.length - 1])}] (${whole(value.length)} values)`;
}

function write(value: unknown, indent: string, room: number): string {
  const short = shortened(value);
  if (short !== null) return short;
  if (!isObject(value)) return JSON.stringify(value) ?? 'null';
  const isList = Array.isArray(value);
  const [open, close] = isList ? ['[', ']'] : ['{', '}'];
  const deeper = `${indent}  `;
  const parts = Object.entries(value).filter(([, each]) => isList || !isUnset(each)).map(([key, each]) => {
    const name = isList ? '' : `${JSON.stringify(key)}: `;
    return name + write(each, deeper, LINE - deeper.length - name.length);
  });
  const line = `${open}${parts.join(', ')}${close}`;
  if (line.length <= room && !line.includes('\n')) return line;
  return `${open}\n${parts.map((part) => deeper + part).join(',\n')}\n${indent}${close}`;
}

export const problemText = (problem: unknown): string => write(problem, '', LINE);
