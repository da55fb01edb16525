import { describe, expect, it } from 'vitest';
import { Ring } from './ring';

function filled(rows: number, step_s: number, ring = new Ring(1, 60, 1000)): Ring {
  for (let i = 0; i < rows; ++i) ring.push(i * step_s, new Float32Array([i]), 0);
  return ring;
}

describe('Ring', () => {
  it('keeps the last minute and forgets what is older', () => {
    const ring = filled(800, 0.1); // 80 s
    expect(ring.newest_s).toBeCloseTo(79.9);
    expect(ring.oldest_s).toBeGreaterThanOrEqual(19.9 - 1e-9);
    expect(ring.oldest_s).toBeLessThan(20.05);
    expect([600, 601]).toContain(ring.rows); // tenths are no binary numbers
    expect(ring.last(0)).toBe(799);
  });

  it('holds a minute of rows that come faster than it has places, and always the newest', () => {
    const ring = filled(70000, 0.001); // 70 s at 1000 Hz in 1000 places
    expect(ring.rows).toBeLessThanOrEqual(1000);
    expect(ring.rows).toBeGreaterThan(900);
    expect(ring.newest_s).toBeCloseTo(69.999);
    expect(ring.newest_s - ring.oldest_s).toBeGreaterThan(58);
    expect(ring.last(0)).toBe(69999);
  });

  it('keeps every row where there are places for all', () => {
    const ring = filled(500, 0.12);
    expect(ring.rows).toBe(500);
  });

  it('starts again when time goes back', () => {
    const ring = filled(10, 1);
    ring.push(0.5, new Float32Array([5]), 0);
    expect(ring.rows).toBe(1);
    expect(ring.last(0)).toBe(5);
  });

  it('takes a row out of the middle of a message', () => {
    const ring = new Ring(2);
    ring.push(1, new Float32Array([1, 2, 3, 4]), 2);
    expect([ring.last(0), ring.last(1)]).toEqual([3, 4]);
  });

  it('has nothing to show while empty', () => {
    const ring = new Ring(1);
    expect(ring.newest_s).toBeNaN();
    expect(ring.last(0)).toBeNaN();
    expect(ring.slice(0, 0, 10, 100)).toEqual({ t_s: [], value: [] });
  });
});

describe('slice', () => {
  it('gives the rows between two times as they are while they are few', () => {
    const { t_s, value } = filled(100, 0.1).slice(0, 2, 3, 500);
    expect(t_s.length).toBe(11);
    expect(value[0]).toBe(20);
    expect(value[10]).toBe(30);
  });

  it('loses no spike, keeps time in order, and stays near the width', () => {
    const ring = new Ring(1, 60, 6000);
    for (let i = 0; i < 6000; ++i) ring.push(i * 0.01, new Float32Array([i === 3217 ? 900 : i % 2]), 0);
    const { t_s, value } = ring.slice(0, 0, 60, 300);
    expect(Math.max(...(value as number[]))).toBe(900);
    expect(t_s.length).toBeLessThanOrEqual(900);
    expect([...t_s].sort((a, b) => a - b)).toEqual(t_s);
  });

  it('shows a gap as a gap', () => {
    const ring = new Ring(1);
    [1, NaN, 3].forEach((v, i) => ring.push(i, new Float32Array([v]), 0));
    expect(ring.slice(0, 0, 2, 100).value).toEqual([1, null, 3]);
  });

  it('shows a pause as a gap', () => {
    const ring = new Ring(1);
    [0, 0.1, 10, 10.1].forEach((t_s) => ring.push(t_s, new Float32Array([t_s]), 0));
    const { t_s, value } = ring.slice(0, 0, 11, 100);
    expect(t_s).toEqual([0, 0.1, 1.1, 10, 10.1]);
    expect(value[2]).toBeNull();
    expect(ring.last(0)).toBeCloseTo(10.1);
  });

  it('reads on over the end of its memory', () => {
    const ring = filled(1500, 0.05, new Ring(1, 60, 1201)); // 75 s, so the newest have wrapped
    const { value } = ring.slice(0, 70, 74.96, 10000);
    expect(value[0]).toBe(1400);
    expect(value[value.length - 1]).toBe(1499);
    expect(value.length).toBe(100);
  });
});
