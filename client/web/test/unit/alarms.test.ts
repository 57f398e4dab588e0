import { describe, expect, it } from 'vitest';

import { AlarmLog } from '../../src/state/alarms';
import { estimate, pointOf } from './samples';

const misfit = (message: string) => ({ code: 'MODEL_MISFIT', message });

describe('AlarmLog', () => {
  it('says since when an alarm is there, whatever its message says by and by', () => {
    const log = new AlarmLog();
    const noon = new Date(2026, 0, 1, 12);
    log.update(estimate({ time: 1 }), noon);
    expect(log.update(estimate({ time: 2, diagnostics: [misfit('1.2 times')] }), noon)).toEqual(['MODEL_MISFIT']);
    expect(log.update(estimate({ time: 3, diagnostics: [misfit('1.4 times'), misfit('of y')] }))).toEqual([]);
    expect(log.active).toHaveLength(1);
    expect(log.active[0]).toMatchObject({ began: { time: 2, at: noon }, beganBefore: false, messages: ['1.4 times', 'of y'] });
  });

  it('does not claim to know when an alarm began that it found', () => {
    const log = new AlarmLog();
    log.update(estimate({ time: 7, diagnostics: [misfit('')] }));
    expect(log.active[0]?.beganBefore).toBe(true);
  });

  it('learns from the history when an alarm began, and what is over', () => {
    const log = new AlarmLog();
    const at = (k: number, ...codes: string[]) =>
      estimate({ time: k, sequence: k, diagnostics: codes.map((code) => ({ code, message: 'so' })) });
    log.catchUp([at(1), at(2, 'A'), at(3, 'A', 'B'), at(4, 'B')].map(pointOf));
    expect(log.active).toMatchObject([{ code: 'B', began: { time: 3, at: null }, beganBefore: false, messages: [] }]);
    expect(log.ended).toMatchObject([{ code: 'A', began: { time: 2, at: null }, ended: { time: 4, at: null } }]);
    const noon = new Date(2026, 0, 1, 12);
    expect(log.update(at(5, 'B', 'C'), noon)).toEqual(['C']);
    expect(log.active).toMatchObject([{ code: 'C', began: { time: 5, at: noon } }, { code: 'B', messages: ['so'] }]);
    log.catchUp([at(4), at(5), at(6, 'C')].map(pointOf));  // what it has seen does not count again
    expect(log.active).toMatchObject([{ code: 'C', began: { time: 5, at: noon }, messages: ['so'] }]);
  });

  it('keeps the last that are over, a bounded number', () => {
    const log = new AlarmLog();
    log.update(estimate());
    for (let k = 0; k < 100_000; ++k) {
      log.update(estimate({ time: 2 * k, diagnostics: [misfit('')] }));
      log.update(estimate({ time: 2 * k + 1 }));
    }
    expect(log.active).toEqual([]);
    expect(log.ended).toHaveLength(20);
    expect(log.ended[0]).toMatchObject({ began: { time: 199_998 }, ended: { time: 199_999 } });
  });
});
