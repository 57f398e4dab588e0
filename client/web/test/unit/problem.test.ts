import { describe, expect, it } from 'vitest';

import { problemText } from '../../src/text/problem';

describe('problemText', () => {
  it('is JSON with short parts on one line', () => {
    const problem = {
      model: { builtin: 'mass_spring_damper' }, fixed: { m: 1, x0: 1 },
      uncertain: [{ name: 'k', uniform: { lower: 31.584, upper: 47.376 } }, { name: 'c', normal: { mean: 0.2, stdDev: 0.05 } }],
    };
    expect(problemText(problem)).toBe([
      '{',
      '  "model": {"builtin": "mass_spring_damper"},',
      '  "fixed": {"m": 1, "x0": 1},',
      '  "uncertain": [',
      '    {"name": "k", "uniform": {"lower": 31.584, "upper": 47.376}},',
      '    {"name": "c", "normal": {"mean": 0.2, "stdDev": 0.05}}',
      '  ]',
      '}'].join('\n'));
    expect(JSON.parse(problemText(problem))).toEqual(problem);
  });

  it('shortens long lists of numbers and contents of files, and says how long they are', () => {
    const text = problemText({ inputs: { u: { samples: { value: Array.from({ length: 10_000 }, (_, k) => k) } } }, fmu: 'A'.repeat(1000) });
    expect(text).toMatch(/"value": \[0, 1, 2, … 9999\] \(10\D?000 values\)/);
    expect(text).toMatch(/"fmu": "A{40}…" \(1\D?000 characters\)/);
    expect(text.length).toBeLessThan(250);
  });

  it('leaves out fields that nobody has set, but no choice and no zero', () => {
    const written = {
      $schema: '', uncertain: [{ name: 'k', uniform: { lower: 0, upper: 1 }, perRun: false }], correlations: [],
      inputs: [{ name: 'road', streamed: { hold: false, interpolation: 'INTERPOLATION_UNSPECIFIED' } }], flags: ['', 'a'],
      expansion: { adaptive: false },
    };
    expect(JSON.parse(problemText(written))).toEqual({
      uncertain: [{ name: 'k', uniform: { lower: 0, upper: 1 }, perRun: false }], inputs: [{ name: 'road', streamed: { hold: false } }],
      flags: ['', 'a'], expansion: { adaptive: false },
    });
  });

  it('writes nothing as null, and an empty problem as such', () => {
    expect(problemText({})).toBe('{}');
    expect(problemText({ a: null, b: {}, c: undefined })).toBe('{"a": null, "b": {}, "c": null}');
  });
});
