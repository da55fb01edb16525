import { describe, expect, it } from 'vitest';
import { decode, encodePicture, kHandSamples, kPosture, kSamples, type Samples } from './wire';

const bytesOf = (numbers: Float64Array | Float32Array): number[] => [...new Uint8Array(numbers.buffer)];
const row = (t_s: number, ...values: number[]): number[] => [
  ...bytesOf(Float64Array.of(t_s)),
  ...bytesOf(Float32Array.from(values)),
];
const message = (kind: number, channels: number, ...rows: number[][]): ArrayBuffer =>
  Uint8Array.from([kind, channels, rows.length, 0, ...rows.flat()]).buffer;

describe('decode', () => {
  it('reads rows of each kind in order, each with its channels', () => {
    for (const kind of [kSamples, kHandSamples, kPosture] as const) {
      const rows = [row(1.25, 512, 300, 34.5, NaN), row(1.26, 513, 301, 35, 2)];
      const values = Float32Array.of(512, 300, 34.5, NaN, 513, 301, 35, 2);
      expect(decode(message(kind, 2, ...rows))).toEqual({ kind, channels: 2, host_s: Float64Array.of(1.25, 1.26), values });
    }
  });

  it('reads the bytes of the document, little endian', () => {
    const bytes = new Uint8Array([1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0xf8, 0x3f, 0, 0, 0, 0x44, 0, 0, 0x20, 0x42]);
    const samples = decode(bytes.buffer) as Samples;
    expect([...samples.host_s, ...samples.values]).toEqual([1.5, 512, 40]);
  });

  it('takes no rows and no fingers', () => {
    expect((decode(message(kSamples, 0)) as Samples).host_s.length).toBe(0);
  });

  it('refuses what is cut, too long, empty or unknown', () => {
    const whole = message(kSamples, 1, row(0, 1, 2));
    const longer = Uint8Array.of(...new Uint8Array(whole), 0).buffer;
    for (const bytes of [whole.slice(0, -1), longer, new ArrayBuffer(0), new ArrayBuffer(3), message(9, 1, row(0, 1, 2))])
      expect(decode(bytes)).toBeNull();
  });

  it('reads a picture of the server', () => {
    const bytes = new Uint8Array(18);
    bytes[0] = 4;
    bytes.set([0xff, 0xd8], 16);
    expect(decode(bytes.buffer)).toEqual({ jpeg: Uint8Array.of(0xff, 0xd8) });
    expect(decode(bytes.buffer.slice(0, 16))).toBeNull();
  });
});

describe('encodePicture', () => {
  it('puts kind, time and JPEG where the document has them', () => {
    const view = new DataView(encodePicture(12.5, new Uint8Array([7, 8]).buffer));
    expect(view.byteLength).toBe(18);
    expect(view.getUint8(0)).toBe(3);
    expect([1, 2, 3, 4, 5, 6, 7].map((i) => view.getUint8(i))).toEqual([0, 0, 0, 0, 0, 0, 0]);
    expect(view.getFloat64(8, true)).toBe(12.5);
    expect([view.getUint8(16), view.getUint8(17)]).toEqual([7, 8]);
  });
});
