// The markerless reference: pictures of the page's camera to joint angles, by a model that no mark helps. A convenience: see
// docs/live.md for how far off it is. Nothing of it is loaded before it is asked for.
import { flexionSign, jointAngles, kBones, type Point } from './hand_angles';
import type { FromWorker, ToWorker } from './markerless_worker';

export const kHasMarkerless = __MARKERLESS__; // whether this page was built with the model
const kLeastBetween_ms = 66; // at most 15 pictures a second
const kWidth_px = 640;

export class Markerless {
  overlay!: HTMLCanvasElement; // over the video
  private worker: Worker | null = null;
  private ready = false;
  private busy = false;
  private last_ms = 0;
  private sign: 1 | -1 = 1;

  failed: (error: string) => void = () => {};

  // `seen` gets null where no hand was found.
  constructor(private readonly seen: (captured_ms: number, angles: Record<string, number> | null) => void) {}

  get loading(): boolean {
    return this.worker !== null && !this.ready;
  }

  open(): void {
    if (this.worker) return;
    this.worker = new Worker(new URL('./markerless_worker.ts', import.meta.url), { type: 'module' });
    this.worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.receive(data);
    this.worker.onerror = () => this.fail();
    this.worker.postMessage({ folder: new URL('markerless/', document.baseURI).href } satisfies ToWorker);
  }

  close(): void {
    if (!this.worker) return;
    this.worker.terminate();
    this.worker = null;
    this.ready = false;
    this.busy = false;
    this.draw(null);
  }

  // The picture that the video shows now; left out while the one before is still looked at.
  async take(video: HTMLVideoElement, captured_ms: number): Promise<void> {
    if (!this.ready || this.busy || captured_ms - this.last_ms < kLeastBetween_ms) return;
    this.busy = true;
    this.last_ms = captured_ms;
    const scale = Math.min(1, kWidth_px / video.videoWidth);
    const picture = await createImageBitmap(video, {
      resizeWidth: Math.round(video.videoWidth * scale),
      resizeHeight: Math.round(video.videoHeight * scale),
    }).catch(() => null); // a camera that goes
    if (!picture) {
      this.busy = false;
      return;
    }
    if (this.overlay.width !== picture.width) this.overlay.width = picture.width; // which clears it
    if (this.overlay.height !== picture.height) this.overlay.height = picture.height;
    this.worker?.postMessage({ picture, captured_ms } satisfies ToWorker, [picture]);
  }

  private fail(): void {
    this.close();
    this.failed('The markerless model could not be loaded. Go back and choose marks or poses.');
  }

  private receive(message: FromWorker): void {
    if ('ready' in message) {
      if (!message.ready) return this.fail();
      this.ready = true;
      return;
    }
    this.busy = false;
    const { points, captured_ms } = message;
    if (points) this.sign = flexionSign(points, this.sign);
    this.draw(points);
    this.seen(captured_ms, points && jointAngles(points, this.sign));
  }

  private draw(points: Point[] | null): void {
    const context = this.overlay.getContext('2d')!;
    context.clearRect(0, 0, this.overlay.width, this.overlay.height);
    if (!points) return;
    context.lineWidth = 3;
    context.strokeStyle = '#ffffff';
    context.fillStyle = '#ffb000';
    context.beginPath();
    for (const [from, to] of kBones) {
      context.moveTo(points[from]!.x, points[from]!.y);
      context.lineTo(points[to]!.x, points[to]!.y);
    }
    context.stroke();
    for (const { x, y } of points) context.fillRect(x - 3, y - 3, 6, 6);
  }
}
