// Figures and names as the page writes them. What is not known is a dash.
import type { Job, Maybe } from './state';

const kUnknown = '–';

export function number(value: Maybe | undefined, digits = 0, unit = ''): string {
  return value === null || value === undefined || !Number.isFinite(value) ? kUnknown : value.toFixed(digits) + unit;
}

export const degrees = (value: Maybe | undefined, digits = 0): string => number(value, digits, '°');
export const percent = (share: Maybe | undefined): string => number((share ?? NaN) * 100, 0, ' %');

// How far a job is.
export function progressOf({ stage, name, fraction, seconds_left }: Job): string {
  const parts = [stage && stage !== name ? title(stage) : '', fraction === null ? '' : percent(fraction)];
  return [...parts, seconds_left === null ? '' : `${number(seconds_left)} s left`].filter(Boolean).join(', ');
}

export function time(seconds: Maybe | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return kUnknown;
  const whole = Math.max(0, Math.floor(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}`;
}

export function title(name: string): string {
  return (name.charAt(0).toUpperCase() + name.slice(1)).replaceAll('_', ' ');
}
