// What was identified: the error of each finger's model beside a straight line's and the best baseline's, all on the held-out part.
import { fingerColour } from './colours';
import { Controls, Segmented, Table, useAsk } from './parts';
import { axis, css, usePlot } from './plots';
import type { Calibration, FingerResult, Maybe, ResultPlot, Verdict } from './state';
import { degrees, number, title } from './text';

const kColumns = ['Finger', 'Model', 'Straight line', 'Best baseline', 'Fit', 'Verdict'];
const kVerdicts: Record<Verdict, string> = {
  better: 'better than the best baseline',
  'as good': 'as good as the best baseline',
  worse: 'worse than the best baseline',
  astray: 'does not follow the finger: repeat',
  expected: 'to be expected',
};

export function Result({ calibration: { step, result, reference } }: { calibration: Calibration }) {
  if (step !== 'result' || !result) return null;
  const { fingers, plot, report, warnings } = result;
  const isMeasured = reference !== 'poses';
  const most = Math.max(1, ...fingers.flatMap((f) => [f.error_deg ?? 0, f.line_deg ?? 0, f.baseline_deg ?? 0]));
  const reference_deg = Math.max(...fingers.map((finger) => finger.reference_error_deg ?? 0));
  const caption = isMeasured
    ? 'Error on the held-out part, degrees RMS'
    : 'What is to be expected, degrees RMS: nothing was measured';
  return (
    <div class="result" data-testid="result">
      <div class="scroll" tabindex={0} role="region" aria-label="Result for each finger">
        <Table test="result-table" kind="result-table" caption={caption} columns={kColumns}>
          {fingers.map((finger) => (
            <Row key={finger.name} finger={finger} most={most} />
          ))}
        </Table>
      </div>
      <p class="muted">
        {reference_deg > 0 && `The camera’s angles err themselves, by up to about ${degrees(reference_deg)}.`}
      </p>
      <details hidden={warnings.length === 0}>
        <summary>{warnings.length === 1 ? 'One warning' : `${warnings.length} warnings`}</summary>
        <ul class="verdicts">
          {warnings.map((text) => (
            <li>{text}</li>
          ))}
        </ul>
      </details>
      {report && (
        <a class="button quiet" target="_blank" href={`files/${report}`}>
          The whole report
        </a>
      )}
      {isMeasured && (
        <Controls id="plot">
          <Plotted names={fingers.map(({ name }) => name)} finger={plot?.finger} />
        </Controls>
      )}
      {plot && <HeldOutPlot plot={plot} />}
    </div>
  );
}

function Plotted({ names, finger }: { names: string[]; finger: string | undefined }) {
  const request = useAsk();
  const pick = (name: string): void => void request('calibrate.plot', { finger: name });
  return <Segmented name="Finger in the plot" test="plot" values={names} pressed={finger} pick={pick} />;
}

function Row({ finger, most }: { finger: FingerResult; most: number }) {
  const { name, error_deg, line_deg, baseline, baseline_deg, fit_percent, verdict } = finger;
  const bar = (kind: string, value_deg: Maybe, of = '') => (
    <td class="bar-cell">
      <span class="bar-number">{`${degrees(value_deg, 1)} ${of}`}</span>
      <span class={`bar bar-${kind}`} aria-hidden="true" style={{ width: `${(100 * (value_deg ?? 0)) / most}%` }} />
    </td>
  );
  return (
    <tr data-testid={`result-${name}`} style={{ '--finger': fingerColour(name) }}>
      <th scope="row">{title(name)}</th>
      {bar('model', error_deg)}
      {bar('line', line_deg)}
      {bar('baseline', baseline_deg, baseline?.replaceAll('_', ' '))}
      <td>{number(fit_percent, 0, ' %')}</td>
      <td class="wrap">{verdict && kVerdicts[verdict]}</td>
    </tr>
  );
}

// What the reference saw of the held-out part, what the model makes of the glove, and a straight line's answer.
const kKeys = ['reference', 'model', 'straight line'];

function HeldOutPlot({ plot: { finger, t_s, reference_deg, model_deg, line_deg } }: { plot: ResultPlot }) {
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
    () => [t_s, reference_deg, model_deg, line_deg],
  );
  return (
    <figure class="result-plot" style={{ '--finger': colour }}>
      <figcaption>{`${title(finger)}, on the part that the fit never saw`}</figcaption>
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
