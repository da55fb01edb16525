// The one connection to the program. It says when it is lost, and tries again until it is there.
import type { State } from './state';
import { refusalWords } from './words';
import { decode, type Picture, type Samples } from './wire';

export interface Hello {
  schema: number;
  version: string;
}

export interface Marker {
  host_s: number;
  text: string;
}

export interface Listeners {
  hello(hello: Hello): void;
  state(state: State): void;
  samples(samples: Samples, arrived_ms: number): void;
  picture(picture: Picture): void;
  marker(marker: Marker): void;
  connected(yes: boolean): void;
}

const kFirstWait_ms = 200;
const kLongestWait_ms = 2000;
const kMostWaiting_bytes = 1 << 20;
const kAnswer_ms = 60000; // flashing a board takes a while

type Waiting = { done: (error: string | null) => void; timer: number };

export class Socket {
  private socket: WebSocket | null = null;
  private wait_ms = kFirstWait_ms;
  private id = 0;
  private readonly waiting = new Map<number, Waiting>();

  constructor(
    private readonly address: string,
    private readonly listeners: Listeners,
  ) {
    this.open();
  }

  // Resolves to null, or to the server's line on what is wrong. Never rejects.
  do(what: string, parts: Record<string, unknown> = {}): Promise<string | null> {
    const socket = this.socket;
    if (!socket || socket.readyState !== WebSocket.OPEN)
      return Promise.resolve('Not connected to the program. Try again when it answers.');
    const id = ++this.id;
    socket.send(JSON.stringify({ id, do: what, ...parts }));
    return new Promise((resolve) => {
      const timer = window.setTimeout(() => this.answer(id, 'The program did not answer. Try again.'), kAnswer_ms);
      this.waiting.set(id, { done: resolve, timer });
    });
  }

  // Wants no answer, and is better left out than late.
  pass(message: string | ArrayBuffer): void {
    const { socket } = this;
    if (socket && socket.readyState === WebSocket.OPEN && socket.bufferedAmount <= kMostWaiting_bytes)
      socket.send(message);
  }

  private open(): void {
    const socket = new WebSocket(this.address);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    socket.onopen = () => {
      this.wait_ms = kFirstWait_ms;
      this.listeners.connected(true);
    };
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => this.receive(event.data);
    socket.onclose = () => {
      for (const id of [...this.waiting.keys()]) this.answer(id, 'The connection was lost. Try again.');
      this.listeners.connected(false);
      window.setTimeout(() => this.open(), this.wait_ms);
      this.wait_ms = Math.min(kLongestWait_ms, this.wait_ms * 1.6);
    };
  }

  private receive(data: string | ArrayBuffer): void {
    if (typeof data !== 'string') {
      const message = decode(data);
      if (!message) return;
      if ('jpeg' in message) this.listeners.picture(message);
      else this.listeners.samples(message, performance.now());
      return;
    }
    let message: { event?: string; id?: number; error?: string } & Record<string, unknown>;
    try {
      message = JSON.parse(data);
    } catch {
      return;
    }
    if (message.event === 'hello') this.listeners.hello(message as unknown as Hello);
    else if (message.event === 'state') this.listeners.state(message as unknown as State);
    else if (message.event === 'marker') this.listeners.marker(message as unknown as Marker);
    else if (typeof message.id === 'number') this.answer(message.id, message.error ? refusalWords(message.error, message) : null);
  }

  private answer(id: number, error: string | null): void {
    const waiting = this.waiting.get(id);
    if (!waiting) return;
    this.waiting.delete(id);
    window.clearTimeout(waiting.timer);
    waiting.done(error);
  }
}

// The socket beside the page, with the token that the page's own address has.
export function socketAddress(page: string): string {
  const address = new URL('socket', page);
  address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
  address.hash = '';
  address.search = '';
  return address.href;
}
