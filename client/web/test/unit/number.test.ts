import { describe, expect, it } from 'vitest';

import { alike, bytes, duration, measured, recordTime, significant, times, unitText, whole, withUnit } from '../../src/text/number';

const plain = (text: string): string => text.replace(/\u202f/g, ' ').replace(/−/g, '-');

describe('measured', () => {
  // The standard deviation has two digits and the value as many decimals.
  it.each([
    [41.2976179, 0.0031734, '41.2976 ± 0.0032'],
    [0.2301548, 0.00049442, '0.23015 ± 0.00049'],
    [75725.3, 372.1, '75 725 ± 372'],
    [1234.5, 99.6, '1235 ± 100'],
    [0.5, 0.0996, '0.50 ± 0.10'],
    [-3.14159, 0.02, '-3.142 ± 0.020'],
    [0, 0.5, '0.00 ± 0.50'],
    [4.7e-12, 1.2e-13, '4.70 ± 0.12·10⁻¹²'],
    [2.1e11, 3e9, '2.100 ± 0.030·10¹¹'],
  ])('%d ± %d is %s', (value, deviation, text) => {
    const { value: v, deviation: d, power } = measured(value, deviation);
    expect(plain(`${v} ± ${d}${power}`)).toBe(text);
  });

  it('never shows what is no number', () => {
    for (const value of [NaN, Infinity, -Infinity, 1, 0, -0]) {
      for (const deviation of [NaN, Infinity, 0, -1, 1]) {
        const text = Object.values(measured(value, deviation)).join(' ');
        expect(text).not.toMatch(/NaN|Infinity|undefined/);
      }
    }
  });
});

describe('numbers', () => {
  it('have as many digits as asked for', () => {
    expect(significant(0.010000000000000092)).toBe('0.0100');
    expect(significant(0.0099999999999)).toBe('0.0100');
    expect(plain(significant(123456, 3))).toBe('123 456');
    expect(significant(1.5e-7, 2)).toBe('1.5·10⁻⁷');
    expect(plain(significant(-2.5e8, 2))).toBe('-2.5·10⁸');
    expect(significant(NaN)).toBe('–');
    expect(significant(Infinity)).toBe('∞');
  });

  it('are written alike where they belong together', () => {
    expect(alike([41.2914036, 41.303841], 0.0032)).toEqual(['41.2914', '41.3038']);
    expect(alike([NaN, 1], 0.1)).toEqual(['–', '1.00']);
  });

  it('have units and sizes as people say them', () => {
    expect(unitText('kg m^2')).toBe('kg m²');
    expect(unitText('m/s^2')).toBe('m/s²');
    expect(unitText('(N s/m)/s^0.5')).toBe('(N s/m)/√s');
    expect(unitText('m^1.5')).toBe('m^1.5');
    expect(withUnit('3', '1')).toBe('3');
    expect(plain(whole(1234567))).toBe('1 234 567');
    expect(times(1436.5)).toBe('1400');
    expect(times(3.21)).toBe('3.2');
    expect(duration(0.42)).toBe('0.4 s');
    expect(duration(200)).toBe('3 min');
    expect(recordTime(12.345)).toBe('12.35 s');
    expect(bytes(67194880)).toBe('64 MiB');
  });

  it('never are NaN', () => {
    for (const text of [whole(NaN), times(NaN), times(0), duration(NaN), recordTime(NaN), bytes(NaN)]) {
      expect(text).toBe('–');
    }
  });
});
