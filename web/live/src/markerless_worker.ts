// Finds a hand in pictures, beside the page's thread. In: the folder of the model, then one picture after the other. Out: that it
// is ready or why not, then for each picture the points that were found.
import { HandLandmarker } from '@mediapipe/tasks-vision';
import type { Point } from './hand_angles';

export type ToWorker = { folder: string } | { picture: ImageBitmap; captured_ms: number };
export type FromWorker = { ready: boolean } | { captured_ms: number; points: Point[] | null };

const kConfidence = 0.2; // below the usual 0.5: a hand from the side is a doubtful one

// What the landmarker's program starts from: what it calls errors are notes of its own.
Object.assign(self, { Module: { printErr: console.debug } });

let landmarker: HandLandmarker | null = null;
let newest_ms = 0;

async function open(folder: string): Promise<void> {
  landmarker = await HandLandmarker.createFromOptions(
    { wasmLoaderPath: `${folder}vision.js`, wasmBinaryPath: `${folder}vision.wasm` },
    {
      baseOptions: { modelAssetPath: `${folder}hand_landmarker.task`, delegate: 'CPU' },
      runningMode: 'VIDEO',
      numHands: 1,
      minHandDetectionConfidence: kConfidence,
      minHandPresenceConfidence: kConfidence,
      minTrackingConfidence: kConfidence,
    },
  );
}

function find(picture: ImageBitmap, captured_ms: number): Point[] | null {
  newest_ms = Math.max(newest_ms + 1, Math.round(captured_ms)); // the landmarker wants whole, growing milliseconds
  const points = landmarker!.detectForVideo(picture, newest_ms).landmarks[0];
  return points?.map(({ x, y }) => ({ x: x * picture.width, y: y * picture.height })) ?? null;
}

function send(message: FromWorker): void {
  self.postMessage(message);
}

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if ('folder' in data) {
    open(data.folder).then(
      () => send({ ready: true }),
      (error) => {
        console.error(error);
        send({ ready: false });
      },
    );
    return;
  }
  const { picture, captured_ms } = data;
  send({ captured_ms, points: find(picture, captured_ms) });
  picture.close();
};
