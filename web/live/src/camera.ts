// The camera that sees the reference: the page's own, whose pictures go to the program, or the program's, which are shown.
import { errorLine, say } from './action';
import type { App } from './app';
import { h, percent, setAttribute, setOptions, setText, show, svg } from './dom';
import { kHasMarkerless, Markerless } from './markerless';
import { createMarks } from './marks';
import type { Calibration } from './state';
import { Webcam } from './webcam';
import type { Picture } from './wire';

export function createCamera(app: App) {
  const error = errorLine('camera-error');
  const picture = createServerPicture();
  const found = svg('svg', { class: 'found', 'aria-hidden': 'true', 'data-testid': 'camera-marks' });
  const wanted = createMarks('marks-wanted');
  const waiting = h('p', { class: 'camera-waiting' });
  const facts = h('p', { class: 'facts', 'data-testid': 'camera-facts' });
  const webcam = new Webcam(app.sendPicture, (wrong) => {
    say(error, wrong);
    void devices.list();
  });
  webcam.video.dataset['testid'] = 'camera-video';
  const devices = createDevices(webcam);
  const markerless = new Markerless(
    (captured_ms, angles) => app.tell('angles', { t_s: captured_ms / 1000, angles: angles ?? {} }),
    (wrong) => say(error, wrong),
  );
  const turnOn = h(
    'button',
    { type: 'button', class: 'button', 'data-testid': 'camera-on', click: () => void webcam.start() },
    'Turn on the camera',
  );
  const element = h(
    'aside',
    { class: 'camera', 'aria-label': 'Camera' },
    h('div', { class: 'camera-frame' }, webcam.video, markerless.overlay, picture.element, found, waiting),
    h('div', { class: 'row' }, turnOn, devices.element),
    facts,
    error,
    wanted.element,
  );
  let asked = false; // once in a calibration: who says no is not asked again and again

  function turn(own: boolean, withoutMarks: boolean): void {
    if (!own && webcam.on) webcam.stop();
    if (own && !asked) void webcam.start();
    if (withoutMarks && !asked) markerless.open();
    if (!withoutMarks) markerless.close();
    webcam.look = withoutMarks ? (captured_ms) => void markerless.take(webcam.video, captured_ms) : null;
    asked = own;
  }

  return {
    element,
    picture(next: Picture) {
      if (!element.hidden) picture.set(next);
    },
    update(calibration: Calibration | null) {
      const looks = calibration !== null && looksNow(calibration);
      const withoutMarks = looks && calibration.reference === 'markerless' && kHasMarkerless;
      const own = looks && calibration.camera === 'page' && (withoutMarks || calibration.reference !== 'markerless');
      webcam.sending = own && calibration.reference === 'marks';
      turn(own, withoutMarks);
      show(element, looks);
      if (!looks) return;
      if (own) picture.clear();
      show(webcam.video, own && webcam.on);
      show(markerless.overlay, withoutMarks && webcam.on);
      show(turnOn, own && !webcam.on);
      const { step, reference, joints, marks_at } = calibration;
      const { videoWidth, videoHeight } = webcam.video;
      const { naturalWidth, naturalHeight } = picture.element;
      const [width, height] = own ? [videoWidth, videoHeight] : [naturalWidth, naturalHeight];
      setAttribute(found, 'viewBox', `0 0 ${width} ${height}`);
      const ring = ([x, y]: [number, number]) => svg('circle', { cx: x * width, cy: y * height, r: width / 70 });
      found.replaceChildren(...marks_at.map(ring));
      wanted.set(step === 'reference' && reference === 'marks' ? joints : null);
      show(waiting, own ? !webcam.on : picture.element.hidden);
      setText(waiting, whyEmpty(calibration, own));
      setText(facts, markerless.loading ? 'The model is being loaded …' : factsOf(calibration));
    },
  };
}

function looksNow({ camera, step }: Calibration): boolean {
  return camera !== 'none' && (step === 'reference' || step === 'motion');
}

function whyEmpty({ reference }: Calibration, own: boolean): string {
  if (reference === 'markerless' && !kHasMarkerless)
    return 'This page carries no markerless model. Go back and choose marks or poses.';
  return own ? 'The camera is off.' : 'Waiting for the program’s picture …';
}

function factsOf({ step, reference, pictures, tracked, marks_found, marks }: Calibration): string {
  const withoutMarks = reference === 'markerless';
  const ask = step === 'motion' || withoutMarks ? '' : 'The whole hand in the picture, every mark in plain sight.';
  const seen = pictures === null ? '' : `${pictures} pictures`;
  const found = !pictures ? '' : withoutMarks ? `a hand found in ${percent(tracked)}` : `${marks_found} of ${marks} marks seen`;
  return [ask, [seen, found].filter(Boolean).join(', ')].filter(Boolean).join(' ');
}

function createServerPicture() {
  const element = h('img', { alt: 'What the program’s camera sees', 'data-testid': 'server-picture', hidden: true });
  let url = '';
  return {
    element,
    set({ jpeg }: Picture) {
      const next = URL.createObjectURL(new Blob([jpeg], { type: 'image/jpeg' }));
      element.src = next;
      if (url !== '') URL.revokeObjectURL(url);
      url = next;
      show(element, true);
    },
    clear: () => show(element, false),
  };
}

// Which of several cameras.
function createDevices(webcam: Webcam) {
  const element = h('select', { 'aria-label': 'Camera', 'data-testid': 'camera-choose', hidden: true });
  element.addEventListener('change', () => void webcam.start(element.value));
  return {
    element,
    async list() {
      const all = (await navigator.mediaDevices?.enumerateDevices()) ?? [];
      const cameras = all.filter(({ kind, deviceId }) => kind === 'videoinput' && deviceId !== '');
      setOptions(
        element,
        cameras.map(({ deviceId, label }, i) => ({ value: deviceId, text: label || `Camera ${i + 1}` })),
      );
      show(element, webcam.on && cameras.length > 1);
    },
  };
}
