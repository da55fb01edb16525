// The binary messages of apps/live/SOCKET.md, schema 1; little endian.

export const kSamples = 1;
export const kHandSamples = 2;
const kCameraPicture = 3;
const kServerPicture = 4;
export const kPosture = 5;

export interface Samples {
  kind: typeof kSamples | typeof kHandSamples | typeof kPosture;
  channels: number;
  host_s: Float64Array; // of each row
  values: Float32Array; // of each row raw, duty or standard error of each channel, then their angles; not known: NaN
}

export interface Picture {
  jpeg: Uint8Array<ArrayBuffer>;
}

// null: not a message of schema 1. A page of an older program must not stumble over what it does not know.
export function decode(buffer: ArrayBuffer): Samples | Picture | null {
  if (buffer.byteLength < 4) return null;
  const view = new DataView(buffer);
  const kind = view.getUint8(0);
  if (kind === kServerPicture) return buffer.byteLength > 16 ? { jpeg: new Uint8Array(buffer, 16) } : null;
  if (kind !== kSamples && kind !== kHandSamples && kind !== kPosture) return null;
  const channels = view.getUint8(1);
  const rows = view.getUint16(2, true);
  if (buffer.byteLength !== 4 + rows * (8 + 8 * channels)) return null;
  const host_s = new Float64Array(rows);
  const values = new Float32Array(2 * rows * channels);
  let at = 4;
  for (let row = 0; row < rows; ++row) {
    host_s[row] = view.getFloat64(at, true);
    at += 8;
    for (let c = 0; c < 2 * channels; ++c, at += 4) values[2 * row * channels + c] = view.getFloat32(at, true);
  }
  return { kind, channels, host_s, values };
}

// A picture of the page's camera, taken at that time of the page's clock.
export function encodePicture(captured_s: number, jpeg: ArrayBuffer): ArrayBuffer {
  const message = new ArrayBuffer(16 + jpeg.byteLength);
  const view = new DataView(message);
  view.setUint8(0, kCameraPicture);
  view.setFloat64(8, captured_s, true);
  new Uint8Array(message, 16).set(new Uint8Array(jpeg));
  return message;
}
