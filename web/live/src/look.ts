// Look: scopes, the link, scores, the twin, sessions and their replay, and writing a board.
import { button, errorLine, say } from './action';
import type { App, Place } from './app';
import { drawLatency } from './frames';
import {
  enable,
  h,
  keyed,
  number,
  panel,
  setAttribute,
  setOptions,
  setProperty,
  setText,
  show,
  tableOf,
  time,
} from './dom';
import { Scopes } from './scopes';
import type { Score, Session } from './state';

export function createLook(app: App): Place {
  const scopes = new Scopes(app);
  const [link, replay, twin, experiment, flash, scores, sessions] = [
    createLink(app),
    createReplay(app),
    createTwin(app),
    createExperiment(app),
    createFlash(app),
    createScores(app),
    createSessions(app),
  ];
  const parts = [link, replay, twin, experiment, flash, scores, sessions];
  const column = (...of: { element: HTMLElement }[]): HTMLElement =>
    h('div', { class: 'look-column' }, ...of.map((part) => part.element));
  const element = h(
    'div',
    { class: 'look' },
    replay.element,
    scopes.element,
    link.element,
    h('div', { class: 'look-parts' }, column(scores, sessions), column(twin, experiment, flash)),
  );
  let visible = false;
  return {
    element,
    update() {
      if (!visible) return;
      scopes.update();
      for (const part of parts) part.update();
    },
    draw: (now_ms) => scopes.draw(now_ms),
    shown(yes) {
      visible = yes;
      scopes.shown(yes);
    },
  };
}

function createLink(app: App) {
  const tile = (name: string, id: string): { element: HTMLElement; value: HTMLElement } => {
    const value = h('dd', { 'data-testid': `link-${id}` }, '–');
    return { element: h('div', { class: 'tile' }, h('dt', {}, name), value), value };
  };
  const rate = tile('Rate', 'rate');
  const latency = tile('Read to sent', 'latency');
  const screen = tile('Message to screen', 'screen');
  const jitter = tile('Jitter of arrival', 'jitter');
  const lost = tile('Frames lost', 'lost');
  const torn = tile('Malformed', 'torn');
  const element = panel(
    'link',
    'Link',
    h('dl', { class: 'tiles' }, ...[rate, latency, screen, jitter, lost, torn].map((t) => t.element)),
  );
  const unit = (value: number | null | undefined, digits: number, of: string): string =>
    value === null || value === undefined || !Number.isFinite(value) ? '–' : `${value.toFixed(digits)} ${of}`;
  return {
    element,
    update() {
      const { link } = app.store.state;
      setText(rate.value, unit(link?.rate_hz, 0, 'Hz'));
      setText(latency.value, unit(link?.latency_ms, 1, 'ms'));
      const drawn = drawLatency();
      setText(screen.value, unit(drawn.median_ms, 0, 'ms'));
      setAttribute(screen.value, 'title', `99th percentile ${number(drawn.p99_ms)} ms of ${drawn.frames} frames`);
      setText(jitter.value, unit(link?.jitter_ms, 1, 'ms'));
      setText(lost.value, link && link.lost === null ? 'not known' : number(link?.lost));
      setText(torn.value, number(link?.torn));
    },
  };
}

function createReplay(app: App) {
  const error = errorLine('replay-error');
  const file = h('p', { class: 'lead', 'data-testid': 'replay-file' });
  const line = h('input', {
    type: 'range',
    min: 0,
    max: 1,
    step: 0.01,
    value: 0,
    'aria-label': 'Time in the recording',
    'data-testid': 'replay-line',
  });
  const clock = h('p', { class: 'facts', 'data-testid': 'replay-clock' });
  const play = button({
    label: 'Play',
    testId: 'replay-play',
    error,
    ask: () => app.do('replay.play', { on: !app.store.state.replay?.playing }),
  });
  const leave = button({
    label: 'Leave the replay',
    testId: 'replay-leave',
    kind: 'quiet',
    error,
    ask: () => app.do('device.leave'),
  });
  const element = panel('replay', 'Replay', file, line, clock, h('div', { class: 'row' }, play, leave), error);
  let held = false;
  line.addEventListener('pointerdown', () => {
    held = true;
  });
  for (const end of ['pointerup', 'pointercancel', 'blur'])
    line.addEventListener(end, () => {
      held = false;
    });
  line.addEventListener('input', () => setText(clock, `${time(Number(line.value))} of ${time(Number(line.max))}`));
  line.addEventListener('change', async () => {
    held = false;
    say(error, await app.do('replay.seek', { t_s: Number(line.value) }));
  });
  return {
    element,
    update() {
      const { replay } = app.store.state;
      show(element, replay !== null);
      if (!replay) return;
      setText(file, replay.file);
      setText(play, replay.playing ? 'Pause' : 'Play');
      if (held) return;
      line.max = String(replay.of_s ?? 1);
      line.value = String(replay.t_s ?? 0);
      setAttribute(line, 'aria-valuetext', `${time(replay.t_s)} of ${time(replay.of_s)}`);
      setText(clock, `${time(replay.t_s)} of ${time(replay.of_s)}`);
    },
  };
}

type TwinPart = 'slip_deg' | 'drift_deg_per_min' | 'noise_counts' | 'loss';
const kSliders: {
  part: TwinPart;
  name: string;
  unit: string;
  min: number;
  max: number;
  step: number;
  digits: number;
  scale: number;
}[] = [
  { part: 'slip_deg', name: 'Slip of the glove', unit: '°', min: -20, max: 20, step: 0.5, digits: 1, scale: 1 },
  { part: 'drift_deg_per_min', name: 'Drift', unit: '° a minute', min: 0, max: 10, step: 0.1, digits: 1, scale: 1 },
  { part: 'noise_counts', name: 'Noise', unit: 'counts', min: 0, max: 20, step: 0.5, digits: 1, scale: 1 },
  { part: 'loss', name: 'Radio loss', unit: '%', min: 0, max: 50, step: 1, digits: 0, scale: 100 },
];

function createTwin(app: App) {
  const error = errorLine('twin-error');
  const sliders = kSliders.map((s) => {
    const input = h('input', {
      type: 'range',
      id: `twin-${s.part}`,
      min: s.min,
      max: s.max,
      step: s.step,
      value: 0,
      'data-testid': `twin-${s.part}`,
    });
    const value = h('output', { for: input.id });
    let touched_ms = -Infinity;
    let isUnderWay = false;
    let isStale = false;
    const write = (): void => {
      setText(value, `${number(Number(input.value), s.digits)} ${s.unit}`.replace(' °', '°'));
      setAttribute(input, 'aria-valuetext', value.textContent);
    };
    // At once, so that a score that is asked for next is one of the new value; while a hand is moving it, one at a time.
    const send = async (): Promise<void> => {
      isStale = isUnderWay;
      if (isUnderWay) return;
      isUnderWay = true;
      do {
        isStale = false;
        say(error, await app.do('twin.set', { [s.part]: Number(input.value) / s.scale }));
      } while (isStale);
      isUnderWay = false;
      touched_ms = performance.now();
    };
    input.addEventListener('input', () => {
      touched_ms = performance.now();
      write();
      void send();
    });
    return {
      element: h('div', { class: 'slider' }, h('label', { for: input.id }, s.name), value, input),
      update(state: number | null): void {
        // What a hand is just moving is not moved back by a state that was on its way.
        if (state === null || performance.now() - touched_ms < 600) return;
        input.value = String(state * s.scale);
        write();
      },
    };
  });
  const element = panel(
    'twin',
    'Twin',
    h('p', { class: 'muted' }, 'What goes wrong with real gloves, at will.'),
    ...sliders.map((s) => s.element),
    error,
  );
  return {
    element,
    update() {
      const { twin } = app.store.state;
      show(element, twin !== null);
      if (!twin) return;
      kSliders.forEach((s, i) => sliders[i]!.update(twin[s.part]));
    },
  };
}

const kGestures = 6;
const kScoreColumns = ['Label', 'Total', '', '1', '2', '3', '4', '5', '6'];

function createScores(app: App) {
  const error = errorLine('score-error');
  const label = h('input', {
    id: 'score-label',
    type: 'text',
    value: '',
    placeholder: 'raw, compensated …',
    maxlength: 40,
    'data-testid': 'score-label',
  });
  const run = button({
    label: 'Run six gestures',
    testId: 'score-run',
    error,
    ask: () => app.do('score.run', { label: label.value.trim() || (app.store.state.model?.name ?? 'raw') }),
  });
  const { table, body } = tableOf(
    'scores',
    'Integral of absolute error, degree seconds, gestures 1 to 6',
    kScoreColumns,
  );
  table.classList.add('scores');
  const scroll = h('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': 'Scores' }, table);
  const empty = h('p', { class: 'empty' }, 'No score yet. A score is the six gestures through what runs now.');
  const element = panel(
    'scores',
    'Scores',
    h('div', { class: 'row' }, h('label', { for: 'score-label', class: 'sr' }, 'Label of the score'), label, run),
    error,
    scroll,
    empty,
  );
  return {
    element,
    update() {
      const { scores, twin } = app.store.state;
      show(element, scores.length > 0 || twin !== null);
      show(scroll, scores.length > 0);
      show(empty, scores.length === 0);
      const most = Math.max(1, ...scores.map((s) => s.total_deg_s ?? 0));
      const rows = scores.map((score, i) => ({ ...score, key: `${i} ${score.label}` }));
      keyed(
        body,
        rows,
        (row) => row.key,
        makeScore,
        (row, score) => fillScore(row, score, most),
      );
    },
  };
}

function makeScore({ label }: Score): HTMLTableRowElement {
  const bar = h('span', { class: 'bar', 'aria-hidden': 'true' });
  const row = h('tr', { 'data-testid': 'score-row' }, h('th', { scope: 'row' }, label), h('td', { class: 'total' }));
  row.append(h('td', { class: 'bar-cell' }, bar));
  for (let gesture = 0; gesture < kGestures; ++gesture) row.append(h('td', {}));
  return row;
}

function fillScore(row: HTMLTableRowElement, score: Score, most: number): void {
  const bar = row.cells[2]!.firstElementChild as HTMLElement;
  setText(row.cells[1]!, number(score.total_deg_s));
  setProperty(bar, 'width', `${Math.round((100 * (score.total_deg_s ?? 0)) / most)}%`);
  for (let gesture = 0; gesture < kGestures; ++gesture) {
    setText(row.cells[3 + gesture]!, number(score.gestures_deg_s[gesture]));
  }
}

function createExperiment(app: App) {
  const error = errorLine('experiment-error');
  const trials = h('input', {
    id: 'trials',
    type: 'number',
    min: 1,
    max: 10000,
    value: 10,
    'data-testid': 'experiment-trials',
  });
  const run = button({
    label: 'Run',
    testId: 'experiment-run',
    error,
    ask: () => app.do('experiment.run', { trials: Number(trials.value) }),
  });
  const { table, body } = tableOf('experiment-result', 'Six gestures together, degree seconds, means', ['Compensator', 'Error']);
  const element = panel(
    'experiment',
    'Experiment',
    h('p', { class: 'muted' }, 'The published experiment in the simulator: six gestures, three compensators.'),
    h('div', { class: 'row' }, h('label', { for: 'trials' }, 'Trials'), trials, run),
    table,
    error,
  );
  return {
    element,
    update() {
      const { job, experiment } = app.store.state;
      enable(run, job?.name !== 'experiment');
      show(table, experiment !== null);
      keyed(
        body,
        experiment ?? [],
        ({ compensator }) => compensator,
        ({ compensator }) => h('tr', {}, h('th', { scope: 'row' }, compensator), h('td', {})),
        (row, { total_deg_s }) => setText(row.cells[1]!, number(total_deg_s)),
      );
    },
  };
}

function createSessions(app: App) {
  const error = errorLine('sessions-error');
  const list = h('ul', { class: 'sessions', 'data-testid': 'sessions' });
  const empty = h('p', { class: 'empty' }, 'No session yet. A recording or a calibration makes one.');
  const element = panel('sessions', 'Sessions', list, empty, error);
  const make = ({ name }: Session): HTMLElement => {
    const ask = (): Promise<string | null> => {
      const file = logOf(app.store.state.sessions.find((session) => session.name === name));
      if (!file) return Promise.resolve(`${name} has no log to replay.`);
      return app.do('replay.open', { session: name, file });
    };
    const replay = button({ label: 'Replay', testId: `replay-${name}`, kind: 'quiet', error, ask });
    const head = h('div', { class: 'session-head' }, h('strong', {}, name), h('span', { class: 'muted' }), replay);
    return h('li', { 'data-testid': 'session' }, head, h('ul', { class: 'files' }));
  };
  return {
    element,
    update() {
      const { sessions } = app.store.state;
      show(empty, sessions.length === 0);
      keyed(list, sessions, (session) => session.name, make, fillSession);
    },
  };
}

// What can be replayed of a session.
function logOf(session: Session | undefined): string | undefined {
  const logs = session?.files.filter((name) => name.endsWith('.csv') && !name.startsWith('markers')) ?? [];
  return logs.find((name) => name === 'log.csv') ?? logs[0];
}

function fillSession(item: Element, session: Session): void {
  const side = session.side ? `${session.side} hand` : null;
  const length = session.seconds === null ? null : time(session.seconds);
  setText(item.querySelector('.muted')!, [session.person, side, length].filter(Boolean).join(', '));
  show(item.querySelector<HTMLElement>('button')!, logOf(session) !== undefined);
  keyed(
    item.querySelector('.files')!,
    session.files,
    (name) => name,
    (name) => {
      const href = ['files', session.name, ...name.split('/')].map(encodeURIComponent).join('/');
      return h('li', {}, h('a', { href, target: '_blank', rel: 'noopener' }, name));
    },
  );
}

function createFlash(app: App) {
  const error = errorLine('flash-error');
  const board = h(
    'select',
    { id: 'flash-board', 'data-testid': 'flash-board' },
    h('option', { value: 'glove' }, 'Glove'),
    h('option', { value: 'hand' }, 'Hand'),
  );
  const port = h('select', { id: 'flash-port', 'data-testid': 'flash-port' });
  const flash = button({
    label: 'Write the board',
    testId: 'flash',
    error,
    ask: () => app.do('flash', { board: board.value, ...(port.value === '' ? {} : { port: port.value }) }),
  });
  const none = h('p', { class: 'muted' }, 'No port is there. Plug in a board.');
  const field = (name: string, control: HTMLElement): HTMLElement =>
    h('div', { class: 'field' }, h('label', { for: control.id }, name), control);
  const element = panel(
    'flash',
    'Flash a board',
    h(
      'p',
      { class: 'muted' },
      'Makes firmware of the model that is worn, for the pins of the wiring table and without tracking, and writes it through the board’s bootloader. For another wiring: flexor deploy, then flexor flash.',
    ),
    h('div', { class: 'row' }, field('Board', board), field('Port', port)),
    h('div', { class: 'row' }, flash),
    none,
    error,
  );
  return {
    element,
    update() {
      const { ports, device, twin } = app.store.state;
      show(element, twin === null || device?.status === 'boards'); // else a twin without boards
      setOptions(
        port,
        [{ value: '', text: 'Where it was heard' }, ...ports.map((p) => ({ value: p.path, text: p.path }))],
      );
      show(none, ports.length === 0);
    },
  };
}
