// A finger of the held-out part: what the reference saw, what the model makes of the glove, and a straight line's answer.
import { fingerColour } from './colours';
import { axis, css, usePlot } from './plots';
import type { ResultPlot } from './state';
import { title } from './text';

const kKeys = ['reference', 'model', 'straight line'];

export function HeldOutPlot({ plot: { finger, t_s, reference_deg, model_deg, line_deg } }: { plot: ResultPlot }) {
  const colour = fingerColour(finger);
  const { place } = usePlot(
    `${finger} ${t_s.length} ${model_deg[model_deg.length >> 1]} ${t_s[0]}`,
    240,
    () => ({
      scales: { x: { time: false } },
      axes: [
        axis({ size: 28, values: (_, ticks) => ticks.map((t) => `${t} s`) }),
        axis({ size: 44, values: (_, ticks) => ticks.map((t) => `${t}°`) }),
      ],
      series: [
        {},
        { stroke: css('--ink'), width: 1.5 },
        { stroke: colour, width: 2 },
        { stroke: css('--muted'), width: 1.25, dash: [5, 4] },
      ],
    }),
    () => [t_s.map((t) => t ?? 0), reference_deg, model_deg, line_deg],
  );
  return (
    <figure class="result-plot" data-testid="result-plot" style={{ '--finger': colour }}>
      <figcaption data-testid="result-plot-caption">{`${title(finger)}, on the part that the fit never saw`}</figcaption>
      <ul class="keys">
        {kKeys.map((name) => (
          <li>
            <span class={`swatch swatch-${name.split(' ').at(-1)}`} aria-hidden="true" />
            {name}
          </li>
        ))}
      </ul>
      <div class="plot" ref={place} />
    </figure>
  );
}
