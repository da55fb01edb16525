// What every part of the page uses: what came over the socket, how to ask for something, and which place is shown.
import { useLayoutEffect, useRef } from 'preact/hooks';
import { Socket, type Message } from './socket';
import { Store } from './store';

export const kPlaces = ['wear', 'calibrate', 'look'] as const;
export type PlaceName = (typeof kPlaces)[number];

export const store = new Store();
export let place: PlaceName = kPlaces.find((name) => `#${name}` === location.hash) ?? 'wear';
let draw = (): void => {};

// `render` shows what `store` and `place` are, now and at each change.
export function start(render: () => void): void {
  draw = render;
  go(place);
}

export function go(name: PlaceName): void {
  place = name;
  history.replaceState(null, '', `#${name}`);
  changed();
}

// While the place is shown: after each message that brought something new.
export function useFrame(where: PlaceName, act: (now_ms: number) => void): void {
  const newest = useRef(act);
  newest.current = act;
  useLayoutEffect(() => {
    const frame = (now_ms: number): void => void (place === where && newest.current(now_ms));
    frames.add(frame);
    return () => frames.delete(frame);
  }, []);
}

// Drawing happens in animation frames, and only when somebody has something new. The socket's messages are only stored.
const frames = new Set<(now_ms: number) => void>();
let isWanted = false;
let oldest_ms = NaN; // arrival of the first message that no frame has shown yet
const latencies: number[] = [];
const kKept = 500;

export function wantFrame(): void {
  if (isWanted) return;
  isWanted = true;
  requestAnimationFrame((now_ms) => {
    isWanted = false;
    const arrived_ms = oldest_ms;
    oldest_ms = NaN;
    for (const frame of frames) frame(now_ms);
    if (Number.isNaN(arrived_ms)) return;
    latencies.push(performance.now() - arrived_ms);
    if (latencies.length > kKept) latencies.shift();
  });
}

// From the message to the end of its drawing: the median and the 99th percentile of the last frames, in ms.
export function drawLatency(): { median_ms: number; p99_ms: number; frames: number } {
  const sorted = [...latencies].sort((a, b) => a - b);
  const at = (share: number): number => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] ?? NaN;
  return { median_ms: at(0.5), p99_ms: at(0.99), frames: sorted.length };
}

// A page that is not looked at draws nothing: what it missed means nothing for drawing.
document.addEventListener('visibilitychange', () => {
  oldest_ms = NaN;
  latencies.length = 0;
});

function changed(): void {
  draw();
  wantFrame();
}

function alarm(): void {
  store.isLost = true;
  changed();
}

function receive(message: Message): void {
  if ('values' in message) {
    store.takeSamples(message);
    if (Number.isNaN(oldest_ms)) oldest_ms = performance.now();
    return wantFrame();
  }
  if ('jpeg' in message) store.takePicture(message);
  else if (message.event === 'state') store.takeState(message);
  else if (message.event === 'marker') store.takeMarker(message);
  else if (message.event === 'hello') store.greet(message.schema);
  changed();
}

let lostTimer = 0;
const socket = new Socket('socket', receive, (yes) => {
  store.connected = yes;
  store.isLost = false;
  window.clearTimeout(lostTimer);
  // A connection that is back within the blink of an eye needs no alarm.
  if (!yes) lostTimer = window.setTimeout(alarm, 300);
  document.body.classList.toggle('stale', !yes);
  changed();
});

// Null, or the program's line on what is wrong.
export const ask = (what: string, parts?: Record<string, unknown>): Promise<string | null> => socket.do(what, parts);
export const pass = (message: string | ArrayBuffer): void => socket.pass(message); // without an answer
