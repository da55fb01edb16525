// The camera that sees the reference: the page's own, whose pictures go to the program, or the program's, which are shown.
import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks';
import { pass, store } from './app';
import { kHasMarkerless, Markerless } from './markerless';
import { Marks } from './marks';
import { Button, Note, Options, Wrong } from './parts';
import type { Calibration } from './state';
import { percent } from './text';
import { Webcam } from './webcam';

const webcam = new Webcam(pass);
const markerless = new Markerless((captured_ms, angles) =>
  pass(JSON.stringify({ do: 'angles', t_s: captured_ms / 1000, angles: angles ?? {} })),
);

export function Camera({ calibration, isFilmed }: { calibration: Calibration; isFilmed: boolean }) {
  const [wrong, report] = useState<string | null>(null);
  const [cameras, setCameras] = useState<MediaDeviceInfo[]>([]); // of which one may be chosen
  const picture = useRef<HTMLImageElement>(null);
  const video = useRef<HTMLVideoElement>(null);
  const overlay = useRef<HTMLCanvasElement>(null);
  const { step, reference, camera, joints, marks_at } = calibration;
  const withoutMarks = isFilmed && reference === 'markerless' && kHasMarkerless;
  const own = isFilmed && camera === 'page' && (withoutMarks || reference !== 'markerless');
  webcam.changed = (why) => {
    report(why);
    void camerasThere().then(setCameras);
  };
  markerless.failed = report;
  useLayoutEffect(() => {
    webcam.video = video.current!;
    markerless.overlay = overlay.current!;
  }, []);
  useEffect(() => {
    if (own) void webcam.start(); // once in a calibration: who declines is not asked again and again
    return () => webcam.stop();
  }, [own]);
  useEffect(() => {
    if (withoutMarks) markerless.open();
    return () => markerless.close();
  }, [withoutMarks]);
  useEffect(() => {
    webcam.sending = own && reference === 'marks';
    webcam.look = withoutMarks ? (captured_ms) => void markerless.take(webcam.video, captured_ms) : null;
  });
  const shown = own ? '' : store.picture;
  const [width, height] = own
    ? [video.current?.videoWidth ?? 0, video.current?.videoHeight ?? 0]
    : [picture.current?.naturalWidth ?? 0, picture.current?.naturalHeight ?? 0];
  return (
    <aside class="camera" aria-label="Camera" hidden={!isFilmed}>
      <div class="camera-frame">
        <video muted playsInline aria-label="Picture of your camera" hidden={!own || !webcam.on} ref={video} />
        <canvas aria-hidden="true" data-testid="camera-skeleton" hidden={!withoutMarks || !webcam.on} ref={overlay} />
        {shown && <img alt="What the program’s camera sees" data-testid="server-picture" src={shown} ref={picture} />}
        <svg class="found" aria-hidden="true" data-testid="camera-marks" viewBox={`0 0 ${width} ${height}`}>
          {marks_at.map(([x, y]) => (
            <circle cx={x * width} cy={y * height} r={width / 70} />
          ))}
        </svg>
        <Note kind="camera-waiting" text={!(own ? webcam.on : shown) && whyEmpty(calibration, own)} />
      </div>
      <div class="row">
        <Button test="camera-on" hidden={!own || webcam.on} act={() => void webcam.start()}>
          Turn on the camera
        </Button>
        <select
          aria-label="Camera"
          hidden={!webcam.on || cameras.length < 2}
          onChange={({ currentTarget }) => void webcam.start(currentTarget.value)}
        >
          <Options of={cameras.map(({ deviceId, label }, i) => [deviceId, label || `Camera ${i + 1}`])} />
        </select>
      </div>
      <p class="facts" data-testid="camera-facts">
        {markerless.loading ? 'The model is being loaded …' : factsOf(calibration)}
      </p>
      <Wrong id="camera" text={wrong} />
      <Marks test="marks-wanted" joints={step === 'reference' && reference === 'marks' ? joints : null} />
    </aside>
  );
}

function whyEmpty({ reference }: Calibration, own: boolean): string {
  if (reference === 'markerless' && !kHasMarkerless)
    return 'This page carries no markerless model. Go back and choose marks or poses.';
  return own ? 'The camera is off.' : 'Waiting for the program’s picture …';
}

function factsOf({ step, reference, pictures, tracked, marks_found, marks }: Calibration): string {
  const withoutMarks = reference === 'markerless';
  const ask = step === 'motion' || withoutMarks ? '' : 'The whole hand in the picture, every mark in plain sight.';
  const seen = `${pictures} pictures`;
  const found = !pictures
    ? ''
    : withoutMarks
      ? `a hand found in ${percent(tracked)}`
      : `${marks_found} of ${marks} marks seen`;
  return [ask, [seen, found].filter(Boolean).join(', ')].filter(Boolean).join(' ');
}

async function camerasThere(): Promise<MediaDeviceInfo[]> {
  const all = (await navigator.mediaDevices?.enumerateDevices()) ?? [];
  return all.filter(({ kind, deviceId }) => kind === 'videoinput' && deviceId !== '');
}
