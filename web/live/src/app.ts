// What every part of the page uses: what came over the socket, how to ask for something, and which place is shown.
import { messageArrived, onFrame, wantFrame } from './frames';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { Socket, socketAddress } from './socket';
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
  useLayoutEffect(() => onFrame((now_ms) => place === where && newest.current(now_ms)), []);
}

function changed(): void {
  draw();
  wantFrame();
}

function alarm(): void {
  store.isLost = true;
  changed();
}

let lostTimer = 0;
const socket = new Socket(socketAddress(document.baseURI), {
  hello({ schema }) {
    store.markers = [];
    if (schema !== 1) store.announced = `The program speaks schema ${schema} and this page schema 1. Reload the page.`;
  },
  state(state) {
    store.takeState(state);
    changed();
  },
  samples(samples, arrived_ms) {
    store.takeSamples(samples);
    messageArrived(arrived_ms);
  },
  marker: (marker) => store.takeMarker(marker),
  picture(picture) {
    store.picture = picture;
    changed();
  },
  connected(yes) {
    store.connected = yes;
    store.isLost = false;
    window.clearTimeout(lostTimer);
    // A connection that is back within the blink of an eye needs no alarm.
    if (!yes) lostTimer = window.setTimeout(alarm, 300);
    document.body.classList.toggle('stale', !yes);
    changed();
  },
});

// Null, or the program's line on what is wrong.
export const ask = (what: string, parts?: Record<string, unknown>): Promise<string | null> => socket.do(what, parts);
export const pass = (message: string | ArrayBuffer): void => socket.pass(message); // without an answer
