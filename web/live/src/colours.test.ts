import { readFileSync } from 'node:fs';
import { Color } from 'three';
import { describe, expect, it } from 'vitest';
import { fingerColour, kFingerColours } from './colours';

function luminance(hex: string): number {
  const { r, g, b } = new Color(hex); // linear
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

function contrast(a: string, b: string): number {
  const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y) as [number, number];
  return (high + 0.05) / (low + 0.05);
}

const css = readFileSync(new URL('./style.css', import.meta.url), 'utf8');
const qualities = [...css.matchAll(/--(good|fair|poor|none): (#[0-9a-f]{6})/g)].map((match) => [match[1]!, match[2]!] as const);
const surfaces = [...css.matchAll(/--surface: (#[0-9a-f]{6})/g)].map((match) => match[1]!);

describe('colours', () => {
  it('reads both surfaces and the four qualities of the style sheet', () => expect([surfaces.length, qualities.length]).toEqual([2, 4]));
  it.each([...Object.entries(kFingerColours), ...qualities])(
    '%s can be seen on the light and on the dark surface',
    (_, colour) => {
      for (const surface of surfaces) expect(contrast(colour, surface)).toBeGreaterThanOrEqual(3);
    },
  );
  it('belong to fingers, whatever joint is sensed', () => {
    expect(fingerColour('index_pip')).toBe(kFingerColours['index']);
    expect(fingerColour('little')).toBe(kFingerColours['pinky']);
    expect(Object.values(kFingerColours)).not.toContain(fingerColour('temperature'));
  });
});
