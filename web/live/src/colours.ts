// Colours that mean something, the same everywhere. Each finger's has a contrast of at least 3 to the light and to the dark
// surface (colours.test.ts), so that it need not change with the scheme.
import { fingerOf } from './mapping';
import type { Quality } from './state';

export const kFingerColours: Record<string, string> = {
  thumb: '#d55e00',
  index: '#1f83d6',
  middle: '#0a9a72',
  ring: '#b565c4',
  pinky: '#b58900',
};

export function fingerColour(channel: string): string {
  const at = fingerOf(channel);
  return at ? kFingerColours[at.finger]! : '#7a828c';
}

export const qualityWords = (quality: Quality): string => (quality === 'none' ? 'not known' : quality);

// The mark of a quality in a square of 16: disc, triangle, square on its corner, ring. Cards show it, and joints in space.
export const kShapes: Record<Quality, string> = {
  good: 'M8 2a6 6 0 0 1 0 12a6 6 0 0 1 0-12z',
  fair: 'M8 1.5 15 14H1z',
  poor: 'M8 .8 15.2 8 8 15.2.8 8z',
  none: 'M8 2.5a5.5 5.5 0 0 1 0 11a5.5 5.5 0 0 1 0-11z',
};
