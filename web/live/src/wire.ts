// The binary messages of apps/live/SOCKET.md, schema 1; little endian.

export const kSamples = 1;
export const kHandSamples = 2;
export const kCameraPicture = 3;
export const kServerPicture = 4;
export const kPosture = 5;

export interface Samples {
  kind: typeof kSamples | typeof kHandSamples | typeof kPosture;
  channels: number;
  rows: number;
  host_s: Float64Array;
  first: Float32Array; // raw, duty or standard error: rows x channels
  angle_deg: Float32Array; // rows x channels; not known: NaN
}

export interface Picture {
  kind: typeof kServerPicture;
  host_s: number;
  jpeg: Uint8Array<ArrayBuffer>;
}

// null: not a message of schema 1. A page of an older program must not stumble over what it does not know.
export function decode(buffer: ArrayBuffer): Samples | Picture | null {
  if (buffer.byteLength < 4) return null;
  const view = new DataView(buffer);
  const kind = view.getUint8(0);
  if (kind === kServerPicture) return decodePicture(buffer, view);
  if (kind !== kSamples && kind !== kHandSamples && kind !== kPosture) return null;
  const channels = view.getUint8(1);
  const rows = view.getUint16(2, true);
  if (buffer.byteLength !== 4 + rows * (8 + 8 * channels)) return null;
  const samples: Samples = {
    kind,
    channels,
    rows,
    host_s: new Float64Array(rows),
    first: new Float32Array(rows * channels),
    angle_deg: new Float32Array(rows * channels),
  };
  let at = 4;
  for (let row = 0; row < rows; ++row) {
    samples.host_s[row] = view.getFloat64(at, true);
    at += 8;
    for (let c = 0; c < channels; ++c, at += 4) samples.first[row * channels + c] = view.getFloat32(at, true);
    for (let c = 0; c < channels; ++c, at += 4) samples.angle_deg[row * channels + c] = view.getFloat32(at, true);
  }
  return samples;
}

function decodePicture(buffer: ArrayBuffer, view: DataView): Picture | null {
  if (buffer.byteLength <= 16) return null;
  return { kind: kServerPicture, host_s: view.getFloat64(8, true), jpeg: new Uint8Array(buffer, 16) };
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
