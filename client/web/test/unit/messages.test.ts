import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

import { describe, expect, it } from 'vitest';

import * as messages from '../../src/api/messages';
import { explain, knownCodes } from '../../src/text/diagnostics';
import { recording } from './samples';

describe('messages of polyestd', () => {
  it('are read with 64-bit integers as numbers', () => {
    const estimate = messages.readEstimate(recording['estimate']);
    expect(estimate.samples).toBe(1000);
    expect(estimate.sequence).toBe(200);
    expect(estimate.parameters.map(({ name, unit, verdict }) => [name, unit, verdict]))
      .toEqual([['k', 'N/m', 'IDENTIFIED'], ['c', 'N s/m', 'IDENTIFIED']]);
    expect(estimate.covariance).toHaveLength(4);
    expect(estimate.directions[0]?.coefficients[0]).toMatchObject({ parameter: 'k' });
    expect(messages.readHistory(recording['history'])).toHaveLength(200);
    expect(messages.readSession(recording['session'])).toMatchObject({ id: 'monday', lastSequence: 200 });
    expect(messages.readPrediction(recording['prediction']).outputs[0]?.score?.autocorrelation).toHaveLength(50);
    expect(messages.readPosterior(recording['posterior']).joints[0]?.density).toHaveLength(32 * 32);
  });

  it('may lack anything', () => {
    for (const nothing of [{}, null, undefined, [], 'text', 7]) {
      expect(messages.readEstimate(nothing)).toMatchObject({ parameters: [], samples: 0 });
      expect(messages.readHistory(nothing)).toEqual([]);
      expect(messages.readSession(nothing).activity.unprocessedBatchCount).toBe(0);
      expect(messages.readSessionPage(nothing)).toEqual({ sessions: [], nextPageToken: '' });
      expect(messages.readPrediction(nothing).outputs).toEqual([]);
      expect(messages.readPosterior(nothing).joints).toEqual([]);
      expect(messages.readDaemonStatus(nothing).durable).toBe(false);
      expect(messages.readWatchEvent(nothing)).toBeNull();
    }
  });

  it('may have numbers that are not finite', () => {
    const parameter = messages.readEstimate({ parameters: [{ name: 'k', map: 'NaN', stdDev: 'Infinity' }] }).parameters[0];
    expect(parameter?.map).toBeNaN();
    expect(parameter?.stdDev).toBe(Infinity);
  });
});

describe('diagnostics', () => {
  // The repository, where the tests do not run in it.
  const source = process.env['POLYEST_SOURCE'] ?? fileURLToPath(new URL('../../../..', import.meta.url));
  const proto = readFileSync(join(source, 'proto/polyest/v1/estimate.proto'), 'utf8');
  const guide = readFileSync(join(source, 'client/diagnostics.md'), 'utf8');
  const codes = [...(/enum Code \{([^}]*)\}/.exec(proto)?.[1] ?? '').matchAll(/^\s*([A-Z_]+) = [1-9]/gm)].map((match) => match[1] as string);

  it('are explained, every one of the contract and no other', () => {
    expect(codes.length).toBeGreaterThan(10);
    expect([...knownCodes()].sort()).toEqual([...codes].sort());
  });

  it('are those of the guide', () => {
    for (const code of knownCodes()) expect(guide).toContain(`## ${code}\n`);
  });

  it('that are new to the page still have a title', () => {
    expect(explain('SOMETHING_NEW').title).toBe('Something new');
  });
});
