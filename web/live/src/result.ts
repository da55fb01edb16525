// What was identified: the error of each finger's model beside a straight line's and the best baseline's, all on the held-out part.
import { errorLine, say } from './action';
import type { App } from './app';
import { fingerColour } from './colours';
import { degrees, h, keyed, number, setAttribute, setProperty, setText, show, tableOf, title } from './dom';
import { createResultPlot } from './result_plot';
import type { Calibration, FingerResult, Verdict } from './state';

export function createResult(app: App) {
  const error = errorLine('plot-error');
  const { table, body } = tableOf('result-table', 'Error on the held-out part, degrees RMS', [
    'Finger',
    'Model',
    'Straight line',
    'Best baseline',
    'Fit',
    'Verdict',
  ]);
  table.classList.add('result-table');
  const errs = h('p', { class: 'muted' });
  const warnings = h('ul', { class: 'verdicts', 'data-testid': 'result-warnings' });
  const howMany = h('summary', {});
  const warned = h('details', { 'data-testid': 'result-warned' }, howMany, warnings);
  const report = h('a', { class: 'button quiet', target: '_blank', 'data-testid': 'result-report' }, 'The whole report');
  const fingers = h('div', { class: 'segmented', role: 'group', 'aria-label': 'Finger in the plot' });
  const plot = createResultPlot();
  const element = h(
    'div',
    { class: 'result', 'data-testid': 'result' },
    h('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': 'Result for each finger' }, table),
    errs,
    warned,
    report,
    fingers,
    error,
    plot.element,
  );
  const choice = ({ name }: FingerResult): HTMLButtonElement => {
    const click = async (): Promise<void> => say(error, await app.do('calibrate.plot', { finger: name }));
    return h('button', { type: 'button', 'data-testid': `plot-${name}`, click: () => void click() }, title(name));
  };
  return {
    element,
    update({ step, result, reference }: Calibration) {
      show(element, step === 'result' && result !== null);
      if (element.hidden || !result) return;
      const isMeasured = reference !== 'poses';
      setText(
        table.caption!,
        isMeasured ? 'Error on the held-out part, degrees RMS' : 'What is to be expected, degrees RMS: nothing was measured',
      );
      for (const part of [fingers, plot.element]) show(part, isMeasured);
      show(report, !!result.report);
      if (result.report) report.setAttribute('href', `files/${result.report}`);
      const count = result.warnings?.length ?? 0;
      show(warned, count > 0);
      setText(howMany, count === 1 ? 'One warning' : `${count} warnings`);
      keyed(
        warnings,
        (result.warnings ?? []).map((text) => ({ text })),
        ({ text }) => text,
        ({ text }) => h('li', {}, text),
      );
      const most = Math.max(1, ...result.fingers.flatMap(errorsOf));
      const nameOf = (finger: FingerResult): string => finger.name;
      keyed(body, result.fingers, nameOf, makeRow, (row, finger) => fillRow(row, finger, most));
      const reference_deg = Math.max(...result.fingers.map((finger) => finger.reference_error_deg ?? 0));
      setText(errs, reference_deg > 0 ? `The camera’s angles err themselves, by up to about ${degrees(reference_deg)}.` : '');
      keyed(fingers, result.fingers, nameOf, choice, (button, { name }) => {
        setAttribute(button, 'aria-pressed', String(name === result.plot?.finger));
      });
      plot.set(result.plot);
    },
  };
}

function makeRow({ name }: FingerResult): HTMLTableRowElement {
  const bar = (style: string): HTMLElement => {
    const drawn = h('span', { class: `bar ${style}`, 'aria-hidden': 'true' });
    return h('td', { class: 'bar-cell' }, h('span', { class: 'bar-number' }), drawn);
  };
  const row = h(
    'tr',
    { 'data-testid': `result-${name}` },
    h('th', { scope: 'row' }, title(name)),
    bar('bar-model'),
    bar('bar-line'),
    bar('bar-baseline'),
    h('td', {}),
    h('td', { class: 'wrap' }),
  );
  setProperty(row, '--finger', fingerColour(name));
  return row;
}

function fillRow(row: HTMLTableRowElement, finger: FingerResult, most: number): void {
  const set = (cell: Element, value: number | null, name = ''): void => {
    setText(cell.querySelector('.bar-number')!, `${degrees(value, 1)} ${name}`);
    setProperty(cell.querySelector<HTMLElement>('.bar')!, 'width', `${Math.round((100 * (value ?? 0)) / most)}%`);
  };
  set(row.cells[1]!, finger.error_deg);
  set(row.cells[2]!, finger.line_deg);
  set(row.cells[3]!, finger.baseline_deg, finger.baseline?.replaceAll('_', ' '));
  setText(row.cells[4]!, finger.fit_percent === null ? '–' : `${number(finger.fit_percent)} %`);
  setText(row.cells[5]!, finger.verdict ? kVerdicts[finger.verdict] : '');
}

function errorsOf({ error_deg, line_deg, baseline_deg }: FingerResult): number[] {
  return [error_deg ?? 0, line_deg ?? 0, baseline_deg ?? 0];
}

const kVerdicts: Record<Verdict, string> = {
  better: 'better than the best baseline',
  'as good': 'as good as the best baseline',
  worse: 'worse than the best baseline',
  astray: 'does not follow the finger: repeat',
  expected: 'to be expected',
};
