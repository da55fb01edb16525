// uPlot with the page's own colours. It is loaded when the first plot is shown.
import type uPlot from 'uplot';

export type Plot = uPlot;
export type Plots = typeof uPlot;

let loaded: Promise<Plots> | null = null;
export function loadPlots(): Promise<Plots> {
  loaded ??= Promise.all([import('uplot'), import('uplot/dist/uPlot.min.css')]).then(([module]) => module.default);
  return loaded;
}

export function css(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

export function axis(extra: Partial<uPlot.Axis> = {}): uPlot.Axis {
  return {
    stroke: css('--muted'),
    font: `11px ${css('--font')}`,
    grid: { stroke: css('--line'), width: 1 },
    ticks: { show: false },
    gap: 4,
    ...extra,
  };
}

// Plots take their colours when made: another scheme, other plots.
export function onScheme(redraw: () => void): void {
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);
}
