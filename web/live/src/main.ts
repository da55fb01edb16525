// The page of `flexor live`: three places, one socket. What it shows is the program's; it keeps nothing that must not be lost.
import './style.css';
import { button, errorLine } from './action';
import type { App, Place } from './app';
import { createCalibrate } from './calibrate';
import { enable, h, progressOf, setAttribute, setText, show, title } from './dom';
import { messageArrived, onFrame, wantFrame } from './frames';
import { createLook } from './look';
import { Socket, socketAddress } from './socket';
import { Store } from './store';
import { statusWord } from './panels';
import { createWear } from './wear';
import { nextWords } from './words';

const kPlaces = ['wear', 'calibrate', 'look'] as const;
type PlaceName = (typeof kPlaces)[number];

const store = new Store();
let socket: Socket | null = null;
const polite = h('div', { class: 'sr', 'aria-live': 'polite', role: 'status' });
const app: App = {
  store,
  do: (what, parts) => socket?.do(what, parts) ?? Promise.resolve('The page is still starting. Try again.'),
  tell: (what, parts) => socket?.pass(JSON.stringify({ do: what, ...parts })),
  sendPicture: (message) => socket?.pass(message),
  announce: (text) => setText(polite, text),
  go,
};
const places: Record<PlaceName, Place> = {
  wear: createWear(app),
  calibrate: createCalibrate(app),
  look: createLook(app),
};
let current: PlaceName = (kPlaces as readonly string[]).includes(location.hash.slice(1))
  ? (location.hash.slice(1) as PlaceName)
  : 'wear';

// ---- the frame around the places

const tabs = new Map<PlaceName, HTMLButtonElement>();
const panels = new Map<PlaceName, HTMLElement>();
for (const name of kPlaces) {
  tabs.set(
    name,
    h(
      'button',
      {
        type: 'button',
        role: 'tab',
        id: `tab-${name}`,
        class: 'tab',
        'aria-controls': `place-${name}`,
        'data-testid': `tab-${name}`,
        click: () => go(name),
      },
      title(name),
    ),
  );
  panels.set(
    name,
    h(
      'div',
      {
        role: 'tabpanel',
        id: `place-${name}`,
        class: 'place',
        tabindex: '-1',
        'aria-labelledby': `tab-${name}`,
        'data-testid': `place-${name}`,
      },
      places[name].element,
    ),
  );
}
const tabList = h('div', { class: 'tabs', role: 'tablist', 'aria-label': 'Places' }, ...tabs.values());
tabList.addEventListener('keydown', (event) => {
  const at = kPlaces.indexOf(current);
  const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: kPlaces.length - 1 }[event.key];
  if (to === undefined) return;
  event.preventDefault();
  const name = kPlaces[(to + kPlaces.length) % kPlaces.length]!;
  go(name);
  tabs.get(name)!.focus();
});

const lost = h(
  'p',
  { class: 'lost', role: 'alert', 'data-testid': 'lost', hidden: true },
  'The program does not answer. Trying again …',
);
const next = h('p', { class: 'next', 'data-testid': 'next', 'aria-live': 'polite' }, 'Connecting to the program …');
const statusDot = h('span', { class: 'dot', 'aria-hidden': 'true' });
const statusText = h('span', {});
const status = h('p', { class: 'status', 'data-testid': 'status' }, statusDot, statusText);
const job = createJob();

function createJob() {
  const error = errorLine('strip-error');
  const text = h('span', { class: 'job-text', 'data-testid': 'job' });
  const bar = h('progress', { max: 1, 'aria-label': 'Share of the job done' });
  const cancel = button({
    label: 'Stop',
    testId: 'strip-cancel',
    kind: 'quiet',
    error,
    ask: () => app.do('job.cancel'),
  });
  const element = h('div', { class: 'job', hidden: true }, text, bar, cancel, error);
  let ended = '';
  let ended_ms = -Infinity;
  let started = false;
  return {
    element,
    update() {
      const { job: now, last } = store.state;
      const key = JSON.stringify(last);
      if (key !== ended) {
        ended = key;
        if (started) ended_ms = performance.now();
      }
      started = true;
      const fresh = last !== null && performance.now() - ended_ms < (last.ok ? 8000 : 30000);
      show(element, now !== null || fresh);
      show(bar, now !== null);
      show(cancel, now !== null);
      enable(cancel, true);
      element.classList.toggle('failed', now === null && last?.ok === false);
      if (now) {
        setText(text, `${title(now.name)}: ${progressOf(now)}`);
        if (now.share === null) bar.removeAttribute('value');
        else bar.value = now.share;
      } else if (last) setText(text, `${last.ok ? '✓' : '✕'} ${title(last.job)}: ${last.text}`);
    },
  };
}

const root = document.querySelector('#app')!;
root.append(
  h('a', { class: 'skip', href: '#main' }, 'To the content'),
  h(
    'header',
    { class: 'top' },
    h('h1', { class: 'brand' }, h('img', { src: './icon.svg', alt: '', width: 28, height: 28 }), 'Flexor'),
    tabList,
    status,
  ),
  h('main', { id: 'main', class: 'main' }, lost, job.element, next, ...panels.values()),
  polite,
);

function go(name: PlaceName): void {
  current = name;
  for (const place of kPlaces) {
    const here = place === name;
    const tab = tabs.get(place)!;
    setAttribute(tab, 'aria-selected', String(here));
    tab.tabIndex = here ? 0 : -1;
    show(panels.get(place)!, here);
    places[place].shown(here);
  }
  show(next, name === 'wear');
  history.replaceState(null, '', `#${name}`);
  update();
  wantFrame();
}

function update(): void {
  const { state, connected } = store;
  const device = state.device;
  setText(next, state.next ? nextWords(state.next, state) : connected ? 'Waiting for the program …' : 'Connecting to the program …');
  const kind = !connected
    ? 'off'
    : device === null || device.status === 'none'
      ? 'none'
      : device.status === 'gone'
        ? 'off'
        : device.status === 'listening'
          ? 'wait'
          : 'on';
  setAttribute(statusDot, 'class', `dot dot-${kind}`);
  setText(statusText, connected ? statusWord(device) : 'Not connected');
  tabs.get('calibrate')!.classList.toggle('busy', state.calibration !== null);
  job.update();
  for (const name of kPlaces) places[name].update();
}

onFrame((now_ms) => places[current].draw(now_ms));
go(current);

// ---- the socket

let lostTimer = 0;
socket = new Socket(socketAddress(document.baseURI), {
  hello(hello) {
    store.markers = [];
    if (hello.schema !== 1)
      app.announce(`The program speaks schema ${hello.schema} and this page schema 1. Reload the page.`);
  },
  state(state) {
    store.takeState(state);
    update();
    wantFrame();
  },
  samples(samples, arrived_ms) {
    store.takeSamples(samples);
    messageArrived(arrived_ms);
  },
  marker: (marker) => store.takeMarker(marker),
  picture(picture) {
    places.calibrate.picture?.(picture);
  },
  connected(yes) {
    store.connected = yes;
    window.clearTimeout(lostTimer);
    // A connection that is back within the blink of an eye needs no alarm.
    if (yes) show(lost, false);
    else lostTimer = window.setTimeout(() => show(lost, true), 300);
    document.body.classList.toggle('stale', !yes);
    update();
  },
});
