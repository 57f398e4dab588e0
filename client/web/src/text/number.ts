// Writes numbers for people: as many digits as they deserve, and a dash for what is no number.

export const DASH = '–';
const MINUS = '−';

const typographic = (text: string): string => text.replace(/-/g, MINUS);

function withPower(value: number, digits: number): string {
  const [mantissa, exponent] = value.toExponential(digits).split('e') as [string, string];
  return `${typographic(mantissa)}·10${superscript(Number(exponent))}`;
}

function superscript(exponent: number): string {
  return String(exponent).replace(/[-0-9]/g, (c) => (c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[Number(c)] as string));
}

// Puts thin spaces between thousands of whole numbers of five digits and more.
function grouped(text: string): string {
  const [whole, ...rest] = text.split('.') as [string, ...string[]];
  const digits = whole.replace(/^-/, '').length;
  const spaced = digits < 5 ? whole : whole.replace(/\B(?=(\d{3})+$)/g, '\u202f');
  return [spaced, ...rest].join('.');
}

// A number with `digits` significant digits; 0 exactly is "0".
export function significant(value: number, digits = 3): string {
  if (Number.isNaN(value)) return DASH;
  if (!Number.isFinite(value)) return value > 0 ? '∞' : `${MINUS}∞`;
  if (value === 0) return '0';
  const rounded = Number(value.toPrecision(digits));  // 0.0099999 is 0.0100
  const size = Math.abs(rounded);
  if (size < 1e-4 || size >= 1e7) return withPower(value, digits - 1);
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return typographic(grouped(value.toFixed(Math.min(decimals, 20))));
}

// A whole number with its thousands apart.
export const whole = (value: number): string =>
  Number.isFinite(value) ? typographic(grouped(Math.round(value).toFixed(0))) : DASH;

export interface Measured {
  value: string;
  deviation: string;
  power: string;  // "·10⁻⁶" that belongs to both, or ""
}

// How many decimals show two significant digits of `deviation`.
function decimalsOf(deviation: number): number {
  const exponent = Math.floor(Math.log10(deviation));
  // 0.0996 has two digits as 0.10.
  const rounded = Number(deviation.toPrecision(2));
  return Math.floor(Math.log10(rounded)) > exponent ? -exponent : 1 - exponent;
}

// A value and its standard deviation: the deviation has two significant digits, the value as many
// decimals as that. Very large and small values have a common power of ten.
export function measured(value: number, deviation: number): Measured {
  if (!Number.isFinite(value)) return { value: significant(value), deviation: DASH, power: '' };
  if (!Number.isFinite(deviation) || deviation <= 0) {
    return { value: significant(value, 6), deviation: deviation === 0 ? '0' : DASH, power: '' };
  }
  const largest = Math.max(Math.abs(value), deviation);
  const exponent = Math.floor(Math.log10(largest));
  const scale = exponent < -3 || exponent >= 6 ? exponent : 0;
  const decimals = Math.min(20, Math.max(0, decimalsOf(deviation / 10 ** scale)));
  const write = (x: number): string => typographic(grouped((x / 10 ** scale).toFixed(decimals)));
  return { value: write(value), deviation: write(deviation), power: scale === 0 ? '' : `·10${superscript(scale)}` };
}

// Values of one quantity, such as the ends of an interval, with as many decimals as `deviation` asks for.
export function alike(values: readonly number[], deviation: number): string[] {
  const reference = values.find((value) => Number.isFinite(value)) ?? 0;
  return values.map((value) => {
    if (!Number.isFinite(value)) return significant(value);
    const largest = Math.max(Math.abs(reference), deviation);
    const exponent = largest > 0 ? Math.floor(Math.log10(largest)) : 0;
    if (exponent < -3 || exponent >= 6 || !(deviation > 0)) return significant(value, 4);
    return typographic(grouped(value.toFixed(Math.min(20, Math.max(0, decimalsOf(deviation))))));
  });
}

// A unit after a number: pure numbers have none, and powers are raised.
export const unitText = (unit: string): string =>
  unit === '' || unit === '1' ? '' : unit.replace(/\bs\^0\.5/g, '√s').replace(/\^(-?\d+)(?![\d.])/g, (_, exponent) => superscript(Number(exponent)));
export const withUnit = (text: string, unit: string): string =>
  unitText(unit) === '' ? text : `${text} ${unitText(unit)}`;

// A length of time in words: "0.4 s", "12 s", "3 min", "5 h", "2 d".
export function duration(seconds: number): string {
  if (!Number.isFinite(seconds)) return DASH;
  if (seconds < 1) return `${significant(Math.max(0, seconds), 1)} s`;
  if (seconds < 120) return `${Math.round(seconds)} s`;
  if (seconds < 7200) return `${Math.round(seconds / 60)} min`;
  if (seconds < 172_800) return `${Math.round(seconds / 3600)} h`;
  return `${Math.round(seconds / 86_400)} d`;
}

// A time of the record, s.
export const recordTime = (seconds: number): string =>
  Number.isFinite(seconds) ? `${typographic(grouped(seconds.toFixed(Math.abs(seconds) < 1000 ? 2 : 1)))} s` : DASH;

// How many times narrower something has become: "1,400 ×" rounded to two digits.
export function times(ratio: number): string {
  if (!Number.isFinite(ratio) || ratio <= 0) return DASH;
  const digits = ratio < 10 ? 2 : Math.max(1, Math.min(2, Math.ceil(Math.log10(ratio))));
  const rounded = Number(ratio.toPrecision(digits));
  return rounded >= 1e7 ? withPower(rounded, 1) : grouped(String(rounded));
}

export function bytes(count: number): string {
  if (!Number.isFinite(count)) return DASH;
  const mebi = count / 2 ** 20;
  return mebi < 1024 ? `${significant(mebi, mebi < 100 ? 2 : 3)} MiB` : `${significant(mebi / 1024, 3)} GiB`;
}
