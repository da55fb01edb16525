// The hand's place on the page: the drawing, which hand and from where, what the marks mean, and what the hand complains of.
import { useEffect, useRef, useState } from 'preact/hooks';
import { place as shownPlace, store, useFrame } from './app';
import { known, qualityWords } from './colours';
import { wantFrame } from './frames';
import type { HandScene, View } from './hand';
import { fingerOf, type FingerName } from './mapping';
import { QualityShape, Segmented } from './parts';
import type { Quality, Side, State } from './state';
import { title } from './text';

const kQualities: Quality[] = ['good', 'fair', 'poor', 'none']; // from the best to the worst
const kTurn_rad = 0.15; // by an arrow key
const kTurn_radPerPx = 0.008;

// After the first paint, so that three.js keeps nobody waiting for the sentence and the cards.
function useScene(failed: (why: string) => void) {
  const place = useRef<HTMLDivElement>(null);
  const [scene, setScene] = useState<HandScene | null>(null);
  const isWanted = shownPlace === 'wear';
  useEffect(() => {
    if (!isWanted || scene) return;
    import('./hand')
      .then(({ HandScene }) => {
        const made = new HandScene(place.current!, new URL('hand/', document.baseURI).href, wantFrame);
        for (const [name, value] of [
          ['role', 'img'],
          ['tabindex', '0'],
          ['data-testid', 'hand-canvas'],
        ] as const)
          made.canvas.setAttribute(name, value);
        place.current!.append(made.canvas);
        makeTurnable(made);
        setScene(made);
      })
      .catch(() => failed('This browser draws no 3-D here. The cards show every angle.'));
  }, [isWanted]);
  return { place, scene };
}

export function Stage() {
  const { state } = store;
  const [message, setMessage] = useState<string | null>('Drawing the hand …');
  const { place, scene } = useScene(setMessage);
  const [chosen, choose] = useState<Side | null>(null); // by the switch, until the model says another
  const [view, setView] = useState<View>('palm');
  const modelSide = state.model?.side ?? null;
  const side = chosen ?? modelSide ?? 'right';
  const look = (from: View): void => {
    setView(from);
    scene?.setView(from); // also where it is turned by hand
  };
  useEffect(() => {
    if (modelSide) choose(null);
  }, [modelSide]);
  useEffect(() => {
    scene?.setSide(side).catch(() => setMessage('The drawn hand could not be loaded. Reload the page.'));
  }, [scene, side]);
  const inWords = wordsOf(state, side);
  useEffect(() => scene?.canvas.setAttribute('aria-label', inWords), [scene, inWords]);
  useFrame('wear', () => {
    scene?.setPose(store.handPose(), qualitiesOf(state));
    scene?.setBionic(store.bionicPose());
    if (scene?.render()) setMessage(null);
  });
  const hasBionic = store.bionicPose() !== null;
  const isStill = state.fingers.length > 0 && state.fingers.every(({ angle_deg }) => angle_deg === null);
  const faults = faultsOf(state);
  return (
    <section class={`stage ${hasBionic ? 'two' : ''}`} aria-label="Hand" data-testid="stage">
      <div class="stage-canvas" ref={place} />
      <div class="stage-labels" aria-hidden="true">
        <span>{isStill ? 'Your hand, not calibrated: it stands still' : 'Your hand'}</span>
        <span hidden={!hasBionic}>{`Bionic hand${kHandWords[state.hand?.status ?? ''] ?? ''}`}</span>
      </div>
      <p class="stage-message" hidden={message === null}>
        {message}
      </p>
      <p class="stage-fault" data-testid="hand-fault" hidden={faults === ''}>
        {faults}
      </p>
      <div class="stage-bar">
        <Segmented name="Which hand is drawn" test="side" values={['left', 'right']} pressed={side} pick={choose} />
        <Segmented name="Seen from" test="view" values={['palm', 'side', 'back']} pressed={view} pick={look} />
      </div>
      <ul class="legend" aria-label="Marks on the joints">
        {kQualities.map((quality) => (
          <li>
            <QualityShape quality={quality} />
            {qualityWords(quality)}
          </li>
        ))}
        <li>
          <span class="dashed-ring" aria-hidden="true" />
          estimated
        </li>
      </ul>
    </section>
  );
}

function qualitiesOf({ fingers }: State): Partial<Record<FingerName, Quality>> {
  const out: Partial<Record<FingerName, Quality>> = {};
  for (const { name, quality } of fingers) {
    const at = fingerOf(name);
    if (at) out[at.finger] = worse(out[at.finger], known(quality));
  }
  return out;
}

function wordsOf({ fingers }: State, side: Side): string {
  const angles = fingers.map((finger) => {
    const called_deg = Math.round(store.called_deg(finger, finger.angle_deg));
    return `${finger.name} ${Number.isNaN(called_deg) ? 'not known' : `${called_deg} degrees`}`;
  });
  return `${title(side)} hand. ${angles.join(', ')}. Arrow keys turn it.`;
}
const kHandWords: Record<string, string> = {
  simulated: ', simulated',
  gone: ', unplugged',
  waits: ', which waits for its glove',
};

function faultsOf(state: State): string {
  const faults = state.hand?.faults ?? [];
  return [...faults.map((text, i) => (text ? `${title(state.hand?.names[i] ?? '')}: ${text}` : '')), state.hand?.board]
    .filter(Boolean)
    .join(' ');
}

function worse(a: Quality | undefined, b: Quality): Quality {
  return a && kQualities.indexOf(a) > kQualities.indexOf(b) ? a : b;
}

// By dragging, and by arrow keys.
function makeTurnable(scene: HandScene): void {
  let last_px: number | null = null;
  scene.canvas.addEventListener('pointerdown', (event) => {
    last_px = event.clientX;
    scene.canvas.setPointerCapture(event.pointerId);
  });
  scene.canvas.addEventListener('pointermove', (event) => {
    if (last_px === null) return;
    scene.turn((last_px - event.clientX) * kTurn_radPerPx);
    last_px = event.clientX;
  });
  for (const end of ['pointerup', 'pointercancel']) {
    scene.canvas.addEventListener(end, () => {
      last_px = null;
    });
  }
  scene.canvas.addEventListener('keydown', (event) => {
    const turn = { ArrowLeft: kTurn_rad, ArrowRight: -kTurn_rad }[event.key];
    if (turn === undefined) return;
    event.preventDefault();
    scene.turn(turn);
  });
}
