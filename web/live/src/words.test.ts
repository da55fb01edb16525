import { describe, expect, it } from 'vitest';
import type { Calibration, State } from './state';
import { askWords, missingWords, nextWords, refusalWords } from './words';

const calibration = (parts: Partial<Calibration>) => ({ reference: 'marks', result: null, ...parts }) as Calibration;

describe('words', () => {
  it('have a sentence for each kind, with its details', () => {
    const state = {} as State;
    expect(nextWords({ kind: 'look_at', finger: 'index', why: 'no reading' }, state)).toBe('Look at index: no reading.');
    expect(nextWords({ kind: 'take', misfits: 'ring' }, state)).toContain('Does not fit: ring');
    expect(nextWords({ kind: 'take' }, state)).not.toContain('fit:');
    expect(nextWords({ kind: 'of_a_newer_program' }, state)).toBe('Of a newer program');
    expect(missingWords('')).toBe('Complete');
    expect(refusalWords('motion_too_short', { seconds: 12.3, least_s: 30 })).toContain('12 s so far, 30 s');
    expect(refusalWords('a.csv: no number')).toBe('a.csv: no number');
  });
  it('name the fingers that a model does not follow', () => {
    const finger = { error_deg: 40, line_deg: 5, baseline: 'line', baseline_deg: 5, fit_percent: -60, reference_error_deg: null };
    const fingers = [{ name: 'index', verdict: 'better' as const }, { name: 'ring', verdict: 'astray' as const }];
    const result = { fingers: fingers.map((f) => ({ ...finger, ...f })), plot: null, warnings: [], report: null };
    expect(askWords('result', calibration({ result }))).toContain('does not follow Ring');
  });
});
