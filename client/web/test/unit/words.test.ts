import { describe, expect, it } from 'vitest';

import { readEstimate, readHistory, readSession } from '../../src/api/messages';
import { compare } from '../../src/text/comparison';
import { estimateCsv, historyCsv } from '../../src/text/csv';
import { priorInterval } from '../../src/text/prior';
import { shownOf } from '../../src/text/shown';
import { statusOf } from '../../src/text/status';
import { tradeOffSentences } from '../../src/text/trade_offs';
import { estimate, parameter, recording } from './samples';

describe('trade-offs in words', () => {
  const direction = (verdict: 'WEAK' | 'NOT_IDENTIFIED' | 'IDENTIFIED', ...values: [string, number][]) =>
    ({ information: 1, verdict, coefficients: values.map(([name, value]) => ({ parameter: name, value })) });
  const words = (changes: Parameters<typeof estimate>[0]): string[] => tradeOffSentences(estimate(changes)).map(({ text }) => text);

  it('say what may move without being seen', () => {
    expect(words({ directions: [direction('NOT_IDENTIFIED', ['k', 0.7], ['m', 0.7])] }))
      .toEqual(['If k and m rise together, the measurements hardly change: the data cannot tell these apart.']);
    expect(words({ directions: [direction('WEAK', ['k', -0.6], ['m', 0.7], ['c', 0.01])] }))
      .toEqual(['If m rises while k falls, the measurements change only a little: the data cannot tell these apart.']);
    expect(words({ directions: [direction('NOT_IDENTIFIED', ['c', 1], ['k', 0])] }))
      .toEqual(['The measurements hardly change with c.']);
  });

  it('name combinations that are known, with how well', () => {
    const tradeOff = { first: 'k', second: 'm', combination: 'k/m', relativeStdDev: 0.0012, firstAlone: 0.3, secondAlone: 0.31 };
    expect(words({ tradeOffs: [tradeOff] })).toEqual(['k/m is known to 0.12 %, but alone k only to 30 % and m only to 31 %.']);
  });

  it('say when errors go together', () => {
    const parameters = [parameter('a'), parameter('b')];
    expect(words({ parameters, covariance: [1, -0.95, -0.95, 1] }))
      .toEqual(['If a is too large, b is too small (correlation −0.95).']);
    expect(words({ parameters, covariance: [0, 0, 0, 0] })[0]).toMatch(/determine every combination/);
  });

  it('do not say of a pair what a direction has said', () => {
    const parameters = [parameter('k'), parameter('m')];
    const directions = [direction('NOT_IDENTIFIED', ['k', 0.7], ['m', 0.7])];
    expect(words({ parameters, directions, covariance: [1, 0.99, 0.99, 1] })).toHaveLength(1);
  });

  it('say so when there is nothing to say', () => {
    expect(tradeOffSentences(readEstimate(recording['estimate']))[0]?.weight).toBe('good');
    expect(words({})[0]).toMatch(/one parameter only/);
  });
});

describe('the number that stands for a parameter', () => {
  it('is the most probable value, as the command prints it, whatever the shape', () => {
    expect(shownOf(parameter('k', { map: 10, mean: 10.1, posteriorStdDev: 1.1 }))).toEqual({ value: 10, deviation: 1, isMean: false });
    expect(shownOf(parameter('k', { map: 36.3, stdDev: 3.1, mean: 41, posteriorStdDev: 4 }))).toEqual({ value: 36.3, deviation: 3.1, isMean: false });
    expect(shownOf(parameter('k', { map: 0, stdDev: 0.2, mean: 0.3, posteriorStdDev: 0.2, verdict: 'WEAK' })).value).toBe(0);
  });
  it('is the mean where the data say less than the prior', () => {
    expect(shownOf(parameter('k', { verdict: 'NOT_IDENTIFIED', mean: 9, posteriorStdDev: 4 }))).toEqual({ value: 9, deviation: 4, isMean: true });
  });
  it('is the mean where the distribution is much wider than one of its pieces', () => {
    expect(shownOf(parameter('k', { map: 36.3, stdDev: 2, mean: 41, posteriorStdDev: 4 }))).toEqual({ value: 41, deviation: 4, isMean: true });
  });
  it('is the most probable value of an older daemon that says no more', () => {
    expect(shownOf(parameter('k', { verdict: 'NOT_IDENTIFIED', posteriorStdDev: 0 })).isMean).toBe(false);
  });
});

describe('comparison of two sessions', () => {
  const judge = (changes: Parameters<typeof parameter>[1]) => compare([parameter('k')], [parameter('k', changes)])[0];
  it('goes by the standard deviation of the difference', () => {
    expect(judge({ map: 12 })).toMatchObject({ tone: 'good', words: 'They agree: 1.4 standard deviations apart.' });
    expect(judge({ map: 13.5 })).toMatchObject({ tone: 'weak', words: 'They may differ: 2.5 standard deviations apart, seldom by chance.' });
    expect(judge({ map: 20 })?.tone).toBe('bad');
    expect(judge({ map: NaN })?.tone).toBe('none');
  });
  it('does not compare what cannot be compared', () => {
    expect(judge({ unit: 'm' })?.tone).toBe('none');
    expect(judge({ verdict: 'NOT_IDENTIFIED', map: 100 })?.tone).toBe('none');
    expect(compare([parameter('a')], [parameter('b')]).map(({ name, words }) => [name, words]))
      .toEqual([['a', 'In the first only.'], ['b', 'In the second only.']]);
  });
});

describe('priors', () => {
  const problem = (prior: object) => ({ uncertain: [{ name: 'k', ...prior }] });
  it('give their central 95 %', () => {
    expect(priorInterval(problem({ uniform: { lower: 0, upper: 100 } }), parameter('k'))).toEqual({ lower: 2.5, upper: 97.5 });
    // exp(μ ± 1.96 σ) with σ² = log 2 and μ = −σ²/2
    const lognormal = priorInterval(problem({ lognormal: { mean: 1, stdDev: 1 } }), parameter('k[3]'));
    expect(lognormal.lower).toBeCloseTo(0.13829, 4);
    expect(lognormal.upper).toBeCloseTo(3.6156, 3);
    const normal = priorInterval(problem({ normal: { mean: 9, stdDev: 5 } }), parameter('k'));
    expect(normal.lower).toBeCloseTo(9 - 1.96 * 5, 3);
    expect(priorInterval(problem({ gamma: { shape: 1, scale: 9 } }), parameter('k')).lower).toBe(0);
    const drift = { uncertain: [{ name: 'c', drift: { randomWalk: { unknown: true, lower: 0.01, upper: 1 } } }] };
    expect(priorInterval(drift, parameter('c.drift')).lower).toBeCloseTo(10 ** -1.95, 6);
    const noise = { processNoise: [{ state: 'v', unknown: true, lower: 1e-4, upper: 1 }] };
    expect(priorInterval(noise, parameter('processNoise.v')).upper).toBeCloseTo(10 ** -0.1, 6);
    expect(priorInterval({ uncertain: [{ name: 'K[1]', uniform: { lower: 0, upper: 100 } }] }, parameter('K[1]'))).toEqual({ lower: 2.5, upper: 97.5 });
    expect(priorInterval(null, parameter('k')).upper).toBeCloseTo(18.8, 3);
  });
});

describe('priors of a population', () => {
  const interval = (prior: object, name: string, population = true) =>
    priorInterval({ uncertain: [{ name: 'k', perRun: true, population, ...prior }] }, parameter(name, { priorMean: 3.3, priorStdDev: 4.32 }));
  it('give a spread about half the prior, lognormal', () => {
    // exp(log(d/2) ± 1.96): 0.28 … 14.2 for d = 4
    const normal = interval({ normal: { mean: 40, stdDev: 4 } }, 'k.spread');
    expect(normal.lower).toBeCloseTo(0.28172, 4);
    expect(normal.upper).toBeCloseTo(14.198, 2);
    const score = interval({ uniform: { lower: 0, upper: 100 } }, 'k.spread');
    expect(score.upper).toBeCloseTo(3.5496, 3);
    // The logarithm of a lognormal parameter of mean 1 and deviation 1 deviates by √log 2.
    expect(interval({ lognormal: { mean: 1, stdDev: 1 } }, 'k.spread').upper).toBeCloseTo(3.5496 * Math.sqrt(Math.LN2), 3);
  });
  it('give a median the prior that is stated, and a mean the daemon\'s', () => {
    expect(interval({ uniform: { lower: 0, upper: 100 } }, 'k.median')).toEqual({ lower: 2.5, upper: 97.5 });
    expect(interval({ normal: { mean: 40, stdDev: 4 } }, 'k.mean').upper).toBeCloseTo(3.3 + 1.96 * 4.32, 3);
    expect(interval({ normal: { mean: 40, stdDev: 4 } }, 'k.spread', false).lower).toBeCloseTo(3.3 - 1.96 * 4.32, 3);
  });
});

describe('downloads', () => {
  it('have all digits, and cells that no spreadsheet computes', () => {
    const text = estimateCsv(estimate({ parameters: [parameter('=k', { map: 1 / 3, stdDev: NaN })] }));
    expect(text.split('\r\n')[1]).toContain("'=k,N/m,0.3333333333333333,,10,1.01,8,12");
  });
  it('have one row for each estimate of the history', () => {
    const lines = historyCsv(readHistory(recording['history']), new Map([['k', 'N/m']])).trimEnd().split('\r\n');
    expect(lines).toHaveLength(201);
    expect(lines[0]).toBe('time [s],samples,batch,k mean [N/m],k sd [N/m],k lower95 [N/m],k upper95 [N/m],c mean,c sd,c lower95,c upper95');
    for (const line of lines) expect(line.split(',')).toHaveLength(11);
  });
});

describe('the state of a session', () => {
  const session = readSession({ lastSequence: '3', activity: {} });
  const base = { id: 'monday', estimate: null, estimateAt: null, session: null, connection: { kind: 'open' as const } };
  const label = (changes: object): string => statusOf({ ...base, ...changes }, 100_000).label;
  it('is said in words', () => {
    expect(label({})).toBe('Waiting for data');
    expect(label({ session })).toBe('No estimate yet');
    expect(label({ estimate: estimate(), session })).toBe('Idle');
    expect(label({ estimate: estimate(), session, estimateAt: 99_000 })).toBe('Live');
    expect(label({ estimate: estimate(), session, estimateAt: 50_000 })).toBe('No new data');
    const behind = readSession({ lastSequence: '3', activity: { hasWriter: true, unprocessedBatchCount: '100' } });
    expect(label({ estimate: estimate(), session: behind, estimateAt: 50_000 })).toBe('Behind');
    expect(label({ connection: { kind: 'gone' } })).toBe('Deleted');
    const lost = statusOf({ ...base, connection: { kind: 'lost', reason: 'the daemon cannot be reached', retryAt: 102_500 } }, 100_000);
    expect(lost).toMatchObject({ label: 'Stream lost', detail: 'The daemon cannot be reached. Trying again in 3 s.', hasRetry: true });
  });
});
