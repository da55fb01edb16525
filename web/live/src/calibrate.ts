// Calibrate: from a glove on the hand to a proven model, step by step. The steps are the server's; here they are shown.
import { button, errorLine, toggle } from './action';
import type { App, Place } from './app';
import { createCamera } from './camera';
import { fingerColour } from './colours';
import { enable, h, keyed, percent, setAttribute, setProperty, setText, show, time, title } from './dom';
import { createResult } from './result';
import { beep, isLoud, setLoud, wakeSound } from './sound';
import { createStart } from './start';
import { kSteps, type Calibration, type Coverage, type Step } from './state';
import type { Picture } from './wire';
import { askWords, missingWords } from './words';

const kStepNames: Record<Step, string> = {
  glove: 'Glove',
  reference: 'Reference',
  motion: 'Motion',
  identify: 'Identify',
  result: 'Result',
  send: 'Send',
};

export function createCalibrate(app: App): Place {
  const steps = createSteps();
  const start = createStart(app);
  const work = createWork(app);
  const element = h('div', { class: 'calibrate', click: wakeSound }, steps.element, start.element, work.element);
  return {
    element,
    update() {
      const { calibration } = app.store.state;
      steps.update(calibration?.step ?? null);
      show(start.element, calibration === null);
      show(work.element, calibration !== null);
      start.update();
      work.update(calibration);
    },
    draw() {},
    shown() {},
    picture: (picture) => work.picture(picture),
  };
}

function createSteps() {
  const items = kSteps.map((step, i) =>
    h(
      'li',
      { 'data-testid': `step-${step}` },
      h('span', { class: 'step-number', 'aria-hidden': 'true' }, String(i + 1)),
      h('span', { class: 'step-name' }, kStepNames[step]),
      h('span', { class: 'sr step-state' }),
    ),
  );
  const element = h(
    'ol',
    { class: 'steps', 'aria-label': 'Steps of the calibration', 'data-testid': 'steps' },
    ...items,
  );
  return {
    element,
    update(step: Step | null) {
      const now = step ? kSteps.indexOf(step) : -1;
      items.forEach((item, i) => {
        setAttribute(item, 'aria-current', i === now ? 'step' : null);
        item.classList.toggle('done', i < now);
        setText(item.querySelector('.step-state')!, i < now ? ', done' : '');
      });
    },
  };
}

function createWork(app: App) {
  const told = h('p', { class: 'say', 'aria-live': 'polite', 'data-testid': 'calibrate-say' });
  const clock = h('progress', {
    max: 1,
    value: 0,
    'aria-label': 'Time in this step',
    'data-testid': 'calibrate-progress',
  });
  const clockText = h('p', { class: 'facts' });
  const then = h('p', { class: 'lead', 'data-testid': 'calibrate-then' });
  const loud = toggle('A tone at each change', 'sound', (on) => {
    setLoud(on);
    loud.set(on);
  });
  loud.set(isLoud());
  const camera = createCamera(app);
  const coverage = createCoverage();
  const result = createResult(app);
  const nav = createNav(app);
  const left = h(
    'div',
    { class: 'work-main' },
    told,
    h('div', { class: 'clock' }, then, clock, clockText, loud.element),
    result.element,
    coverage.element,
    nav.element,
  );
  const element = h('section', { class: 'panel work', 'aria-label': 'The step' }, left, camera.element);
  let asked: string | null = null; // in the motion, before
  return {
    element,
    picture: (picture: Picture) => camera.picture(picture),
    update(calibration: Calibration | null) {
      camera.update(calibration);
      if (!calibration) return;
      setText(told, askWords(calibration.asks, calibration));
      const asks = calibration.step === 'motion' ? calibration.asks : null;
      if (asks && asks !== asked) beep();
      asked = asks;
      setText(then, whatFollows(calibration));
      const timed = calibration.of_seconds !== null && calibration.of_seconds > 0 && calibration.step === 'motion';
      show(clock.parentElement!, timed);
      clock.max = calibration.of_seconds ?? 1;
      clock.value = Math.min(clock.max, calibration.seconds ?? 0);
      const isLonger = (calibration.seconds ?? 0) > clock.max;
      setText(clockText, isLonger ? time(calibration.seconds) : `${time(calibration.seconds)} of ${time(clock.max)}`);
      coverage.update(
        calibration.step === 'motion' || calibration.step === 'reference' ? (calibration.covered ?? []) : [],
      );
      show(coverage.element, calibration.step === 'motion');
      result.update(calibration);
      nav.update(calibration);
      element.classList.toggle('with-camera', !camera.element.hidden);
    },
  };
}

function whatFollows(calibration: Calibration): string {
  const { left_s, then } = calibration;
  if (left_s === null) return '';
  const left = `${Math.ceil(left_s)} s`;
  return then ? `In ${left}: ${askWords(then, calibration)}` : `${left} more`;
}

const kSeen = 0.5; // share of the marks, as the program

const kCovered: { part: 'range' | 'slow' | 'fast' | 'holds'; name: string }[] = [
  { part: 'range', name: 'Bends' },
  { part: 'slow', name: 'Slow' },
  { part: 'fast', name: 'Fast' },
  { part: 'holds', name: 'Holds' },
];

function createCoverage() {
  const list = h('ul', { class: 'coverage' });
  const element = h('div', { 'data-testid': 'coverage' }, h('h3', {}, 'What has been covered'), list);
  return {
    element,
    update(covered: Coverage[]) {
      keyed(
        list,
        covered,
        (c) => c.name,
        (c) => {
          const item = h(
            'li',
            { 'data-testid': `covered-${c.name}` },
            h('strong', {}, title(c.name)),
            ...kCovered.map(({ part, name }) =>
              h(
                'span',
                { class: `part part-${part}` },
                h('span', { class: 'part-name' }, name),
                h('span', { class: 'meter', 'aria-hidden': 'true' }, h('span', { class: 'meter-fill' })),
                h('span', { class: 'part-share' }),
              ),
            ),
            h('span', { class: 'missing', 'data-testid': `missing-${c.name}` }),
          );
          setProperty(item, '--finger', fingerColour(c.name));
          return item;
        },
        (item, c) => {
          for (const { part } of kCovered) {
            const share = Math.min(1, Math.max(0, c[part] ?? 0));
            const place = item.querySelector<HTMLElement>(`.part-${part}`)!;
            setProperty(place.querySelector<HTMLElement>('.meter-fill')!, 'width', `${Math.round(share * 100)}%`);
            setText(place.querySelector('.part-share')!, share >= 0.995 ? '✓' : percent(share));
            place.classList.toggle('full', share >= 0.995);
          }
          setText(item.querySelector('.missing')!, missingWords(c.missing));
        },
      );
    },
  };
}

function createNav(app: App) {
  const error = errorLine('calibrate-error');
  const make = (label: string, word: string, kind: 'primary' | 'quiet' | undefined) =>
    button({
      label,
      testId: `calibrate-${word}`,
      ...(kind ? { kind } : {}),
      error,
      ask: () => app.do(`calibrate.${word}`),
    });
  const accept = make('Accept', 'accept', 'primary');
  const send = button({
    label: 'Send to the glove',
    testId: 'calibrate-send',
    kind: 'primary',
    error,
    ask: () => app.do('send'),
  });
  const next = button({
    label: 'Next',
    testId: 'calibrate-next',
    kind: 'primary',
    error,
    ask: async () => {
      const isEnd = app.store.state.calibration?.step === 'send';
      const wrong = await app.do('calibrate.next');
      if (isEnd && wrong === null) app.go('wear');
      return wrong;
    },
  });
  const repeat = make('Repeat the motion', 'repeat', undefined);
  const back = make('Back', 'back', undefined);
  const cancel = make('Cancel', 'cancel', 'quiet');
  const element = h('div', {}, h('div', { class: 'row nav' }, accept, send, next, repeat, back, cancel), error);
  return {
    element,
    update({ step, failed, tracked }: Calibration) {
      show(accept, step === 'result');
      show(repeat, step === 'result' || (step === 'identify' && !!failed));
      show(send, step === 'send');
      show(next, step !== 'result' && !(step === 'identify' && !!failed));
      show(back, step !== 'glove');
      const isUnseen = step === 'reference' && (tracked ?? 0) < kSeen;
      enable(next, !isUnseen && (step !== 'identify' || app.store.state.job === null));
      setText(next, step === 'send' ? 'Finish' : 'Next');
      next.classList.toggle('primary', step !== 'send');
    },
  };
}
