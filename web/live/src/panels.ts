// What one does while wearing: record, connect, choose a model and send it, put the glove on anew.
import { button, errorLine, say, toggle } from './action';
import type { App } from './app';
import {
  degrees,
  enable,
  h,
  keyed,
  number,
  panel,
  setOptions,
  setText,
  show,
  tableOf,
  time,
  title,
} from './dom';
import { kFingers } from './mapping';
import type { AnewFinger, Device, Finger } from './state';

const kStatus: Record<Device['status'], string> = {
  none: 'No glove',
  listening: 'Listening',
  glove: 'Glove connected',
  gone: 'Unplugged',
  replay: 'Replaying a recording',
  twin: 'Simulated glove',
  boards: 'Simulated boards',
};

export function statusWord(device: Device | null): string {
  return device ? (kStatus[device.status] ?? device.status) : 'No glove';
}

export function createGlove(app: App) {
  const error = errorLine('device-error');
  const status = h('p', { class: 'lead', 'data-testid': 'device-status' });
  const says = h('p', { class: 'muted', 'data-testid': 'device-says' });
  const facts = h('p', { class: 'facts' });
  const port = h('select', { id: 'port', 'data-testid': 'port' });
  const connect = button({
    label: 'Connect',
    testId: 'device-connect',
    error,
    ask: () => app.do('device.connect', { port: port.value }),
  });
  const leave = button({
    label: 'Disconnect',
    testId: 'device-leave',
    kind: 'quiet',
    error,
    ask: () => app.do('device.leave'),
  });
  const choose = h('div', { class: 'row' }, h('label', { for: 'port', class: 'sr' }, 'Port'), port, connect);
  const names = createNames(app);
  const element = h(
    'section',
    { class: 'panel', 'aria-labelledby': 'panel-glove' },
    h('div', { class: 'panel-head' }, h('h2', { id: 'panel-glove' }, 'Glove'), leave),
    status,
    says,
    facts,
    names.element,
    choose,
    error,
  );
  return {
    element,
    update() {
      const { device, ports } = app.store.state;
      names.update();
      const here = device !== null && !['none', 'gone'].includes(device.status);
      setText(status, [statusWord(device), device?.name].filter(Boolean).join(': '));
      setText(says, device?.says ?? '');
      show(says, !!device?.says);
      setText(
        facts,
        here
          ? [device.port, device.format].filter((fact) => fact && !device.says?.includes(fact)).join(' · ')
          : '',
      );
      show(facts, facts.textContent !== '');
      setOptions(port, [
        { value: 'auto', text: 'What is there' },
        ...ports.map((p) => ({ value: p.path, text: p.name ? `${p.path} (${p.name})` : p.path })),
      ]);
      show(choose, !here);
      show(leave, here);
    },
  };
}

// Which finger each column of a glove without names is: asked once, the program keeps it for that glove.
function createNames(app: App) {
  const error = errorLine('names-error');
  const list = h('div', { class: 'names' });
  const chosen = (): string[] => [...list.querySelectorAll('select')].map(({ value }) => value);
  const save = button({
    label: 'These are the fingers',
    testId: 'names-save',
    kind: 'primary',
    error,
    ask: () => app.do('columns.name', { names: chosen() }),
  });
  const element = h(
    'div',
    { class: 'field', 'data-testid': 'names', hidden: true },
    h('p', {}, 'Its columns have no names. Bend one finger after the other: which reading moves? This is asked once.'),
    list,
    h('div', { class: 'row' }, save),
    error,
  );
  const make = ({ name }: Finger): HTMLElement => {
    const choice = h('select', { 'data-testid': `name-${name}` }, h('option', { value: '' }, 'No finger'));
    choice.append(...kFingers.map((finger) => h('option', { value: finger }, title(finger))));
    return h('label', { class: 'row' }, h('span', {}, title(name)), choice);
  };
  return {
    element,
    update() {
      const { next, fingers } = app.store.state;
      show(element, next?.kind === 'name');
      keyed(list, fingers, ({ name }) => name, make);
    },
  };
}

export function createRecord(app: App) {
  const error = errorLine('record-error');
  const label = h('span', {}, 'Record');
  const record = button({
    label: '',
    testId: 'record',
    kind: 'primary',
    error,
    ask: () => app.do(app.store.state.recording ? 'record.stop' : 'record.start'),
  });
  record.replaceChildren(h('span', { class: 'record-dot', 'aria-hidden': 'true' }), label);
  record.classList.add('record');
  const file = h('p', { class: 'muted', 'data-testid': 'record-file' });
  const element = panel('record', 'Record', record, file, error);
  return {
    element,
    update() {
      const { recording, device } = app.store.state;
      record.classList.toggle('on', recording !== null);
      setText(label, recording ? `Stop ${time(recording.seconds)}` : 'Start recording');
      setText(file, recording ? `${recording.rows} rows in ${recording.file}` : '');
      show(file, recording !== null);
      enable(record, recording !== null || (device !== null && !['none', 'gone', 'listening'].includes(device.status)));
    },
  };
}

export function createModel(app: App) {
  const error = errorLine('model-error');
  const sendError = errorLine('send-error');
  const select = h('select', {
    id: 'model',
    'data-testid': 'model',
    change: async () => {
      say(error, await app.do('model.choose', { path: select.value === '' ? null : select.value }));
    },
  });
  const send = button({ label: 'Send to the glove', testId: 'send', error: sendError, ask: () => app.do('send') });
  const hint = h('p', { class: 'muted' });
  const element = panel(
    'model',
    'Person and model',
    h('label', { for: 'model', class: 'sr' }, 'Person and model'),
    select,
    error,
    send,
    hint,
    sendError,
  );
  return {
    element,
    update() {
      const { model, models, device } = app.store.state;
      const known = model && !models.some((m) => m.path === model.path) ? [model, ...models] : models;
      setOptions(select, [
        { value: '', text: 'No model: readings as they are' },
        ...known.map((m) => ({
          value: m.path,
          text: known.filter(({ name }) => name === m.name).length > 1 ? `${m.name} (${m.path})` : (m.name ?? m.path),
        })),
      ]);
      if (document.activeElement !== select) select.value = model?.path ?? '';
      const glove = device !== null && ['glove', 'boards', 'twin'].includes(device.status);
      enable(send, model !== null);
      setText(
        hint,
        model === null
          ? 'Choose a model, or calibrate, before there is something to send.'
          : glove
            ? ''
            : 'Needs a glove with Flexor’s program.',
      );
      show(hint, hint.textContent !== '');
    },
  };
}

const kMotion = 'Open and close every finger for ten seconds. Nothing changes before you accept.';
const kPutOn = `Glove put on again? ${kMotion}`;
const kSlipped = `The glove has slipped: it reads otherwise than when it was calibrated. ${kMotion}`;

export function createAnew(app: App) {
  const error = errorLine('anew-error');
  const ask = (label: string, word: string, kind?: 'primary' | 'quiet'): HTMLButtonElement =>
    button({ label, testId: `anew-${word}`, ...(kind ? { kind } : {}), error, ask: () => app.do(`anew.${word}`) });
  const start = ask('Ten seconds of motion', 'start');
  const decide = h('div', { class: 'row' }, ask('Accept', 'accept', 'primary'), ask('Keep as it was', 'keep', 'quiet'));
  const intro = h('p', { class: 'muted', 'data-testid': 'anew-intro' }, kPutOn);
  const bar = h('progress', { max: 10, value: 0, 'aria-label': 'Seconds of motion', 'data-testid': 'anew-progress' });
  const clock = h('p', { class: 'facts' });
  const { table, body } = tableOf('anew-table', 'How far off, degrees, by the new calibration', [
    'Finger',
    'Before',
    'After',
    'Verdict',
  ]);
  const tracking = createTracking(app, error);
  const element = panel('anew', 'Put on anew', intro, start, bar, clock, table, decide, tracking.element, error);
  return {
    element,
    update() {
      const { anew, model, next, tracking: isTracking, tracking_remark: why } = app.store.state;
      const fingers = anew?.fingers ?? [];
      const seconds = anew?.seconds ?? 0;
      const of = anew?.of_seconds ?? 10;
      const done = fingers.some((finger) => finger.after_deg !== null || finger.verdict);
      const running = !done && seconds > 0 && seconds < of;
      tracking.update(isTracking, why);
      enable(start, model !== null && !running);
      for (const part of [table, decide]) show(part, done);
      for (const part of [bar, clock]) show(part, running);
      show(start, !done);
      show(intro, !running && !done);
      const isSlipped = next?.kind === 'slipped';
      element.classList.toggle('offered', isSlipped);
      start.classList.toggle('primary', isSlipped);
      setText(intro, isSlipped ? kSlipped : kPutOn);
      bar.max = of;
      bar.value = Math.min(of, seconds);
      setText(clock, `Keep moving: ${number(seconds)} of ${number(of)} s`);
      keyed(body, done ? fingers : [], (finger) => finger.name, makeAnewRow, fillAnewRow);
    },
  };
}

function makeAnewRow({ name }: AnewFinger): HTMLTableRowElement {
  const cells = [h('td', {}), h('td', {}), h('td', { class: 'wrap' })];
  return h('tr', { 'data-testid': `anew-${name}` }, h('th', { scope: 'row' }, title(name)), ...cells);
}

function fillAnewRow(row: HTMLTableRowElement, finger: AnewFinger): void {
  const uncertain = finger.after_deg === null ? '' : `± ${finger.after_deg.toFixed(1)}°`;
  setText(row.cells[1]!, finger.before_deg === null ? 'not known' : `${degrees(finger.before_deg, 1)} ${uncertain}`);
  setText(row.cells[2]!, uncertain);
  setText(row.cells[3]!, finger.verdict ?? '');
}

// On or off as the program says; where it does not say, as it was last asked for.
function createTracking(app: App, error: HTMLElement) {
  const follow = toggle('Follow slow changes while worn', 'tracking', async (on) => {
    const wrong = await app.do('tracking.set', { on });
    say(error, wrong);
    if (wrong === null) follow.set(on);
  });
  const remark = h('p', { class: 'muted', 'data-testid': 'tracking-remark', hidden: true });
  const element = h('div', {}, follow.element, remark);
  return {
    element,
    update(on: boolean | null, why: string | null) {
      if (on !== null) follow.set(on);
      enable(follow.element, !why);
      setText(remark, why ?? '');
      show(remark, !!why);
    },
  };
}
