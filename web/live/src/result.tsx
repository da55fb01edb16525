// What was identified: the error of each finger's model beside a straight line's and the best baseline's, all on the held-out part.
import { ask } from './app';
import { fingerColour } from './colours';
import { Segmented, Table, useLine } from './parts';
import { HeldOutPlot } from './result_plot';
import type { Calibration, FingerResult, Maybe, Verdict } from './state';
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
  const line = useLine('plot-error');
  if (step !== 'result' || !result) return null;
  const { fingers, plot, report } = result;
  const isMeasured = reference !== 'poses';
  const warnings = result.warnings ?? [];
  const most = Math.max(1, ...fingers.flatMap((f) => [f.error_deg ?? 0, f.line_deg ?? 0, f.baseline_deg ?? 0]));
  const reference_deg = Math.max(...fingers.map((finger) => finger.reference_error_deg ?? 0));
  const choose = async (finger: string): Promise<void> => line.say(await ask('calibrate.plot', { finger }));
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
      <details data-testid="result-warned" hidden={warnings.length === 0}>
        <summary>{warnings.length === 1 ? 'One warning' : `${warnings.length} warnings`}</summary>
        <ul class="verdicts" data-testid="result-warnings">
          {warnings.map((text) => (
            <li>{text}</li>
          ))}
        </ul>
      </details>
      {report && (
        <a class="button quiet" target="_blank" data-testid="result-report" href={`files/${report}`}>
          The whole report
        </a>
      )}
      {isMeasured && (
        <Segmented
          name="Finger in the plot"
          test="plot"
          values={fingers.map(({ name }) => name)}
          pressed={plot?.finger}
          pick={(finger) => void choose(finger)}
        />
      )}
      {line.element}
      {isMeasured && plot && plot.t_s.length > 0 && <HeldOutPlot plot={plot} />}
    </div>
  );
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
