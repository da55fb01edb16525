// The page's camera as the reference: JPEG pictures with the time at which the camera took them, or the video itself for who looks
// at it here.
import { encodePicture } from './wire';

const kWidth_px = 640;
const kLeastBetween_ms = 52; // about 18 pictures a second
const kQuality = 0.82; // at this width far from the half MiB that the program takes
const kReasons: Record<string, string> = {
  NotAllowedError: 'The browser may not use the camera. Allow it beside the address, then turn it on.',
  NotFoundError: 'There is no camera. Plug one in, then turn it on.',
  NotReadableError: 'Another program uses the camera. Close that program, then turn it on.',
  NotSupportedError: 'This browser gives pages no camera here. Open the page at 127.0.0.1 or with https.',
};

export class Webcam {
  video!: HTMLVideoElement; // where it is shown
  sending = false;
  look: ((captured_ms: number) => void) | null = null;
  changed: (error: string | null) => void = () => {}; // on, off, or why not
  private stream: MediaStream | null = null;
  private starting = false;
  private encoding = false;
  private last_ms = 0;
  private lastFrame_ms = 0;
  private readonly canvas = document.createElement('canvas');

  constructor(private readonly send: (message: ArrayBuffer) => void) {
    // Where the browser reports no frames (a page that is not looked at), a picture now and then is better than none.
    window.setInterval(() => {
      if (performance.now() - this.lastFrame_ms > 300) this.take(performance.now());
    }, kLeastBetween_ms);
  }

  get on(): boolean {
    return this.stream !== null;
  }

  async start(device: string | null = null): Promise<void> {
    if (this.starting || (this.stream && device === null)) return;
    this.starting = true;
    try {
      if (!navigator.mediaDevices) throw new DOMException('', 'NotSupportedError');
      const stream = await navigator.mediaDevices.getUserMedia({
        audio: false,
        video: { width: { ideal: 1280 }, frameRate: { ideal: 30 }, ...(device ? { deviceId: { exact: device } } : {}) },
      });
      this.stop();
      this.stream = stream;
      this.video.srcObject = stream;
      await this.video.play();
      stream.getVideoTracks()[0]?.addEventListener('ended', () => {
        this.stop();
        this.changed('The camera has gone. Plug it in and turn it on again.');
      });
      this.watch();
      this.changed(null);
    } catch (error) {
      const name = error instanceof DOMException ? error.name : '';
      this.changed(kReasons[name] ?? 'The camera could not be turned on. Try again.');
    }
    this.starting = false;
  }

  stop(): void {
    for (const track of this.stream?.getTracks() ?? []) track.stop();
    this.stream = null;
    this.video.srcObject = null;
  }

  private watch(): void {
    const stream = this.stream;
    if (!('requestVideoFrameCallback' in this.video)) return;
    const next = (now_ms: number, frame: { captureTime?: number }): void => {
      if (this.stream !== stream) return;
      this.lastFrame_ms = performance.now();
      const captured = frame.captureTime;
      this.take(captured !== undefined && Math.abs(captured - now_ms) < 1000 ? captured : now_ms);
      this.video.requestVideoFrameCallback(next);
    };
    this.video.requestVideoFrameCallback(next);
  }

  // The picture that is shown now.
  private take(captured_ms: number): void {
    if (this.stream && this.video.videoWidth > 0) this.look?.(captured_ms);
    if (!this.sending || !this.stream || this.encoding || this.video.videoWidth === 0) return;
    const now_ms = performance.now();
    if (now_ms - this.last_ms < kLeastBetween_ms) return;
    this.last_ms = now_ms;
    const scale = Math.min(1, kWidth_px / this.video.videoWidth);
    this.canvas.width = Math.round(this.video.videoWidth * scale);
    this.canvas.height = Math.round(this.video.videoHeight * scale);
    this.canvas.getContext('2d', { alpha: false })!.drawImage(this.video, 0, 0, this.canvas.width, this.canvas.height);
    this.encoding = true;
    const encoded = (jpeg: Blob | null): void => {
      this.encoding = false;
      void jpeg?.arrayBuffer().then((bytes) => this.send(encodePicture(captured_ms / 1000, bytes)));
    };
    this.canvas.toBlob(encoded, 'image/jpeg', kQuality);
  }
}
