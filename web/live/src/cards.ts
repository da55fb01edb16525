// A card for each finger: angle with its uncertainty, quality, range covered, and the last seconds as a line.
import type { App } from './app';
import { fingerColour, known, kQualityWords, qualityShape } from './colours';
import { degrees, h, keyed, number, percent, setAttribute, setProperty, setText, show, title } from './dom';
import { keep } from './kept';
import type { Finger, Quality } from './state';

interface Card {
  element: HTMLElement;
  update(finger: Finger): void;
  draw(channel: number): void;
}

function createCard(app: App, name: string): Card {
  const angle = h('span', { class: 'card-angle', 'data-testid': `angle-${name}` }, '–');
  const sd = h('span', { class: 'card-sd' });
  const closed = h('span', { class: 'card-closed', 'data-testid': `closed-${name}` });
  const showAngle = (finger: Finger | undefined, angle_deg: number | null): void => {
    setText(angle, degrees(app.store.called_deg(finger, angle_deg)));
    const share = closedShare(finger, angle_deg);
    setText(closed, share === null ? '' : `${percent(share)} closed`);
  };
  const shape = h('span', { class: 'card-shape' });
  const word = h('span', {});
  const meter = h('span', { class: 'meter-fill' });
  const covered = h('span', { class: 'card-covered' });
  const remark = h('p', { class: 'card-remark', hidden: true });
  const tracked = h('p', { class: 'card-tracked muted', 'data-testid': `tracked-${name}`, hidden: true });
  const trace = h('canvas', { class: 'card-trace', 'aria-hidden': 'true' });
  const raw = h('span', { class: 'card-raw', 'data-testid': `raw-${name}` });
  const element = h(
    'article',
    { class: 'card', 'data-testid': `card-${name}`, 'aria-label': title(name) },
    h(
      'div',
      { class: 'card-head' },
      h('h3', {}, title(name)),
      h('span', { class: 'card-quality', 'data-testid': `quality-${name}` }, shape, word),
    ),
    h('p', { class: 'card-value' }, angle, sd, closed),
    trace,
    h(
      'div',
      { class: 'card-range' },
      h('span', { class: 'meter', 'aria-hidden': 'true' }, meter),
      h('p', { class: 'card-foot' }, covered, raw),
    ),
    remark,
    tracked,
  );
  setProperty(element, '--finger', fingerColour(name));
  let quality: Quality | null = null;
  return {
    element,
    update(finger) {
      const now = known(finger.quality);
      if (now !== quality) {
        quality = now;
        shape.replaceChildren(qualityShape(now));
        setText(word, kQualityWords[now]);
      }
      setText(sd, finger.sd_deg === null ? '' : `± ${finger.sd_deg.toFixed(1)}°`);
      setProperty(meter, 'width', `${Math.round(Math.min(1, Math.max(0, finger.covered ?? 0)) * 100)}%`);
      setText(covered, `Range ${percent(finger.covered)}`);
      setText(remark, finger.remark ?? '');
      show(remark, !!finger.remark);
      setText(tracked, finger.tracked ?? '');
      show(tracked, !!finger.tracked);
      setText(raw, finger.raw === null ? '' : `raw ${number(finger.raw)}`);
      setAttribute(raw, 'title', finger.unit);
      if (app.store.glove.angle.rows === 0) showAngle(finger, finger.angle_deg);
    },
    draw(channel) {
      const { angle: ring } = app.store.glove;
      showAngle(app.store.state.fingers[channel], ring.last(channel));
      drawTrace(trace, app, channel, fingerColour(name));
    },
  };
}

// Of the way from the joint's open hand to its fist, whatever its angles are called; null: not known.
function closedShare(finger: Finger | undefined, angle_deg: number | null): number | null {
  const { open_deg = null, fist_deg = null } = finger ?? {};
  if (open_deg === null || fist_deg === null || angle_deg === null || Number.isNaN(angle_deg)) return null;
  return Math.min(1, Math.max(0, (angle_deg - open_deg) / (fist_deg - open_deg)));
}

// What an open hand is called, in degrees.
function createOpenHand(app: App) {
  const input = h('input', {
    id: 'open-hand',
    type: 'number',
    min: -180,
    max: 180,
    step: 'any',
    value: app.store.openHand_deg,
    'data-testid': 'open-hand',
    change: () => {
      if (!input.checkValidity()) input.value = '';
      app.store.openHand_deg = input.value || null;
      keep('open_hand', input.value);
    },
  });
  const element = h(
    'div',
    { class: 'open-hand' },
    h('label', { for: 'open-hand' }, 'My open hand is'),
    input,
    'degrees',
    h('span', { class: 'muted' }, 'Left empty, as the model has it. What is recorded, scored and sent stays as it is.'),
  );
  return {
    element,
    update(fingers: readonly Finger[]) {
      const open = fingers.flatMap(({ open_deg }) => (open_deg === null ? [] : [number(open_deg)]));
      show(element, open.length > 0);
      setAttribute(input, 'placeholder', [...new Set(open)].join(', '));
    },
  };
}

const kTrace_s = 6;

// The last seconds as a line; the reading where no angle is known.
function drawTrace(canvas: HTMLCanvasElement, app: App, channel: number, colour: string): void {
  const { clientWidth: width, clientHeight: height } = canvas;
  if (width === 0) return;
  const ratio = Math.min(2, window.devicePixelRatio);
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const angles = !Number.isNaN(app.store.glove.angle.last(channel));
  const ring = angles ? app.store.glove.angle : app.store.glove.first;
  const to = ring.newest_s;
  const { t_s, value } = ring.slice(channel, to - kTrace_s, to, width / 2);
  const c = canvas.getContext('2d')!;
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, width, height);
  let least = Infinity;
  let most = -Infinity;
  for (const v of value) {
    if (v === null) continue;
    least = Math.min(least, v);
    most = Math.max(most, v);
  }
  if (!Number.isFinite(least)) return;
  const room = Math.max(angles ? 20 : 10, most - least);
  const middle = (least + most) / 2;
  c.beginPath();
  let pen = false;
  t_s.forEach((t, i) => {
    const v = value[i]!;
    if (v === null) {
      pen = false;
      return;
    }
    const x = width * (1 - (to - t) / kTrace_s);
    const y = height / 2 - ((v - middle) / room) * (height - 6);
    if (pen) c.lineTo(x, y);
    else c.moveTo(x, y);
    pen = true;
  });
  c.strokeStyle = colour;
  c.lineWidth = 1.75;
  c.lineJoin = 'round';
  c.stroke();
}

export function createCards(app: App) {
  const list = h('div', { class: 'cards', 'data-testid': 'cards' });
  const empty = h(
    'p',
    { class: 'empty' },
    'No finger is sensed yet. A card for each appears as soon as a glove sends.',
  );
  const made = new Map<Element, Card>();
  const openHand = createOpenHand(app);
  const element = h('section', { 'aria-label': 'Fingers' }, list, empty, openHand.element);
  return {
    element,
    update() {
      const { fingers } = app.store.state;
      show(empty, fingers.length === 0);
      openHand.update(fingers);
      keyed(
        list,
        fingers,
        (finger) => finger.name,
        (finger) => {
          const card = createCard(app, finger.name);
          made.set(card.element, card);
          return card.element;
        },
        (card, finger) => made.get(card)?.update(finger),
      );
    },
    draw() {
      const { channels, rows } = app.store.glove.angle;
      if (rows === 0 || channels !== list.children.length) return;
      Array.from(list.children).forEach((card, channel) => made.get(card)?.draw(channel));
    },
  };
}
