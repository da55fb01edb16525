// A short tone where there is something else to do: who moves a hand looks at the hand.
import { keep, kept } from './kept';

let context: AudioContext | null = null;
let last_ms = -Infinity;

export const isLoud = (): boolean => kept('sound') !== 'off';
export const setLoud = (on: boolean): void => keep('sound', on ? 'on' : 'off');

// Browsers let a page sound after somebody has touched it: for the listener of a click.
export function wakeSound(): void {
  if (isLoud()) void (context ??= new AudioContext()).resume();
}

// At most one a second, for a camera that now sees the hand and now does not.
export function beep(): void {
  if (!isLoud() || context?.state !== 'running' || performance.now() - last_ms < 1000) return;
  last_ms = performance.now();
  const tone = new OscillatorNode(context, { frequency: 880 });
  const level = new GainNode(context, { gain: 0.2 });
  level.gain.setTargetAtTime(0, context.currentTime + 0.12, 0.02);
  tone.connect(level).connect(context.destination);
  tone.start();
  tone.stop(context.currentTime + 0.3);
}
