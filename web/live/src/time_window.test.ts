import { describe, expect, it } from 'vitest';
import { TimeWindow } from './time_window';

function running(now_s: number): TimeWindow {
  const window = new TimeWindow();
  window.advance(now_s);
  return window;
}

describe('TimeWindow', () => {
  it('follows the newest row', () => {
    const window = running(100);
    expect([window.from_s, window.to_s]).toEqual([85, 100]);
    window.advance(101);
    expect([window.from_s, window.to_s]).toEqual([86, 101]);
  });
  it('stands while paused, and runs on from now', () => {
    const window = running(100);
    window.pause();
    window.advance(120);
    expect([window.from_s, window.to_s]).toEqual([85, 100]);
    window.run(5);
    window.advance(120);
    expect([window.from_s, window.to_s]).toEqual([115, 120]);
  });
  it('zooms about its middle', () => {
    const window = running(100);
    window.zoom(0.5, 40);
    expect([window.from_s, window.to_s]).toEqual([88.75, 96.25]);
  });
  it('looks no further than there are rows', () => {
    const window = running(100);
    window.look(30, 40, 60);
    expect([window.from_s, window.to_s]).toEqual([60, 70]);
    window.look(98, 108, 60);
    expect([window.from_s, window.to_s]).toEqual([90, 100]);
    window.look(50, 50, 60);
    expect(window.to_s - window.from_s).toBeCloseTo(0.1);
    window.look(0, 500, 60);
    expect(window.to_s - window.from_s).toBeCloseTo(60);
  });
  it('pans by a share of what is seen', () => {
    const window = running(100);
    window.pan(-1, 0);
    expect([window.from_s, window.to_s]).toEqual([70, 85]);
  });
  it('has ticks at whole steps before now', () => {
    const window = running(100.37);
    expect(window.ticks(85.37, 100.37, 5).map((t) => window.label(t))).toEqual(['−15 s', '−10 s', '−5 s', '0 s']);
    expect(window.label(100.12)).toBe('−0.25 s');
  });
});
