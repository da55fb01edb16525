// The one connection to the program. It reports when it is lost, and tries again until it is there.
import type { State } from './state';
import { refusalWords } from './words';
import { decode, type Picture, type Samples } from './wire';

export interface Marker {
  event: 'marker';
  host_s: number;
  text: string;
}

export type Message = Samples | Picture | ({ event: 'state' } & State) | Marker | { event: 'hello'; schema: number };

const kFirstWait_ms = 200;
const kLongestWait_ms = 2000;
const kMostWaiting_bytes = 1 << 20;
const kAnswer_ms = 60000; // flashing a board takes a while

export class Socket {
  private socket!: WebSocket;
  private wait_ms = kFirstWait_ms;
  private id = 0;
  private readonly waiting = new Map<number, (error: string | null) => void>();

  // `address` is beside the page's own.
  constructor(
    private readonly address: string,
    private readonly received: (message: Message) => void,
    private readonly connected: (yes: boolean) => void,
  ) {
    this.open();
  }

  // Resolves to null, or to the server's line on what is wrong. Never rejects.
  do(what: string, parts: Record<string, unknown> = {}): Promise<string | null> {
    if (this.socket.readyState !== WebSocket.OPEN)
      return Promise.resolve('Not connected to the program. Try again when it answers.');
    const id = ++this.id;
    this.socket.send(JSON.stringify({ id, do: what, ...parts }));
    return new Promise((resolve) => {
      const timer = window.setTimeout(() => this.answer(id, 'The program did not answer. Try again.'), kAnswer_ms);
      this.waiting.set(id, (error) => {
        window.clearTimeout(timer);
        resolve(error);
      });
    });
  }

  // Wants no answer, and is better left out than late.
  pass(message: string | ArrayBuffer): void {
    const { socket } = this;
    if (socket.readyState === WebSocket.OPEN && socket.bufferedAmount <= kMostWaiting_bytes) socket.send(message);
  }

  private open(): void {
    this.socket = new WebSocket(this.address);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => {
      this.wait_ms = kFirstWait_ms;
      this.connected(true);
    };
    this.socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => this.receive(event.data);
    this.socket.onclose = () => {
      for (const id of this.waiting.keys()) this.answer(id, 'The connection was lost. Try again.');
      this.connected(false);
      window.setTimeout(() => this.open(), this.wait_ms);
      this.wait_ms = Math.min(kLongestWait_ms, this.wait_ms * 1.6);
    };
  }

  private receive(data: string | ArrayBuffer): void {
    const message = typeof data === 'string' ? JSON.parse(data) : decode(data);
    if (typeof message?.id === 'number') this.answer(message.id, message.error ? refusalWords(message.error, message) : null);
    else if (message) this.received(message);
  }

  private answer(id: number, error: string | null): void {
    this.waiting.get(id)?.(error);
    this.waiting.delete(id);
  }
}
