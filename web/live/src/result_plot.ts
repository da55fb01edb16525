// A finger of the held-out part: what the reference saw, what the model makes of the glove, and a straight line's answer.
import { fingerColour } from './colours';
import { h, setText, title } from './dom';
import { axis, css, loadPlots, onScheme, type Plot } from './plots';
import type { ResultPlot } from './state';

export function createResultPlot() {
  const place = h('div', { class: 'plot' });
  const caption = h('figcaption', { 'data-testid': 'result-plot-caption' });
  const key = (name: string, style: string): HTMLElement =>
    h('li', {}, h('span', { class: `swatch ${style}`, 'aria-hidden': 'true' }), name);
  const element = h(
    'figure',
    { class: 'result-plot', 'data-testid': 'result-plot' },
    caption,
    h(
      'ul',
      { class: 'keys' },
      key('reference', 'swatch-reference'),
      key('model', 'swatch-model'),
      key('straight line', 'swatch-line'),
    ),
    place,
  );
  let plot: Plot | null = null;
  let drawn = '';
  let data: ResultPlot | null = null;
  let making = false;

  async function make(): Promise<void> {
    if (making || !data) return;
    making = true;
    const Plots = await loadPlots();
    making = false;
    plot?.destroy();
    element.style.setProperty('--finger', fingerColour(data.finger));
    plot = new Plots(
      {
        width: Math.max(200, place.clientWidth),
        height: 240,
        legend: { show: false },
        scales: { x: { time: false } },
        axes: [
          axis({ size: 28, values: (_, ticks) => ticks.map((t) => `${t} s`) }),
          axis({ size: 44, values: (_, ticks) => ticks.map((t) => `${t}°`) }),
        ],
        series: [
          {},
          { stroke: css('--ink'), width: 1.5 },
          { stroke: fingerColour(data.finger), width: 2 },
          { stroke: css('--muted'), width: 1.25, dash: [5, 4] },
        ],
      },
      [data.t_s.map((t) => t ?? 0), data.reference_deg, data.model_deg, data.line_deg],
      place,
    );
  }

  new ResizeObserver(() => plot?.setSize({ width: Math.max(200, place.clientWidth), height: 240 })).observe(place);
  onScheme(() => void make());
  return {
    element,
    set(next: ResultPlot | null) {
      element.hidden = next === null || next.t_s.length === 0;
      if (!next || element.hidden) return;
      setText(caption, `${title(next.finger)}, on the part that the fit never saw`);
      const now = `${next.finger} ${next.t_s.length} ${next.model_deg[next.model_deg.length >> 1]} ${next.t_s[0]}`;
      if (now === drawn) return;
      drawn = now;
      data = next;
      void make();
    },
  };
}
