// What every place of the page is given.
import type { Do } from './action';
import type { Store } from './store';
import type { Picture } from './wire';

export interface App {
  store: Store;
  do: Do;
  tell(what: string, parts: Record<string, unknown>): void; // without an answer
  sendPicture(message: ArrayBuffer): void; // likewise
  announce(text: string): void;
  go(place: 'wear' | 'calibrate' | 'look'): void;
}

export interface Place {
  element: HTMLElement;
  update(): void; // a new state
  draw(now_ms: number): void; // new samples, while the place is shown
  shown(yes: boolean): void;
  picture?(picture: Picture): void;
}
