// uPlot with the page's own colours. It is loaded when the first plot is shown.
import type { RefObject } from 'preact';
import { useLayoutEffect, useRef, useState } from 'preact/hooks';
import type uPlot from 'uplot';

export type Plot = uPlot;
export type PlotData = uPlot.AlignedData;
export type PlotOptions = Omit<uPlot.Options, 'width' | 'height'>;

const kNarrowest_px = 160;
const kScheme = window.matchMedia('(prefers-color-scheme: dark)');

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

// A plot that fills the width of its place. It is made again where `of` is another, or the scheme, from which it takes its colours.
export function usePlot(
  of: string,
  height: number,
  options: () => PlotOptions,
  data: () => PlotData,
): { place: RefObject<HTMLDivElement | null>; plot: RefObject<Plot | null> } {
  const place = useRef<HTMLDivElement>(null);
  const plot = useRef<Plot | null>(null);
  const [isDark, setDark] = useState(kScheme.matches);
  useLayoutEffect(() => {
    const change = (): void => setDark(kScheme.matches);
    kScheme.addEventListener('change', change);
    return () => kScheme.removeEventListener('change', change);
  }, []);
  useLayoutEffect(() => {
    let isWanted = true;
    const size = () => ({ width: Math.max(kNarrowest_px, place.current!.clientWidth), height });
    const observer = new ResizeObserver(() => plot.current?.setSize(size()));
    void Promise.all([import('uplot'), import('uplot/dist/uPlot.min.css')]).then(([{ default: Plots }]) => {
      if (!isWanted) return;
      plot.current = new Plots({ ...size(), legend: { show: false }, ...options() }, data(), place.current!);
      observer.observe(place.current!);
    });
    return () => {
      isWanted = false;
      observer.disconnect();
      plot.current?.destroy();
      plot.current = null;
    };
  }, [of, isDark]);
  return { place, plot };
}
