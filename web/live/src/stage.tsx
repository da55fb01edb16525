// The hand's place on the page: the drawing, which hand and from where, what the marks mean, and what the hand complains of.
import { useEffect, useRef, useState } from 'preact/hooks';
import { place as shownPlace, store, useFrame, wantFrame } from './app';
import { qualityWords } from './colours';
import type { HandScene, Qualities, View } from './hand';
import { fingerOf } from './mapping';
import { Note, QualityShape, Segmented } from './parts';
import type { Quality, Side, State } from './state';
import { title } from './text';

const kQualities: Quality[] = ['good', 'fair', 'poor', 'none']; // from the best to the worst
const kTurn_rad = 0.15; // by an arrow key
const kTurn_radPerPx = 0.008;

export function Stage() {
  const { state } = store;
  const [message, setMessage] = useState<string | null>('Drawing the hand …');
  const [scene, setScene] = useState<HandScene | null>(null);
  const [chosen, choose] = useState<Side | null>(null); // by the switch, until the model has another
  const [view, setView] = useState<View>('palm');
  const canvas = useRef<HTMLCanvasElement>(null);
  const isAsked = useRef(false);
  const last_px = useRef<number | null>(null); // while it is dragged
  const modelSide = state.model?.side ?? null;
  const side = chosen ?? modelSide ?? 'right';
  const look = (from: View): void => {
    setView(from);
    scene?.setView(from); // also where it is turned by hand
  };
  // After the first paint, so that three.js keeps nobody waiting for the sentence and the cards.
  useEffect(() => {
    if (shownPlace !== 'wear' || isAsked.current) return;
    isAsked.current = true;
    import('./hand')
      .then(({ HandScene }) => {
        const made = new HandScene(canvas.current!, wantFrame);
        setScene(made);
        const failed = () => setMessage('The drawn hand could not be loaded. Reload the page.');
        made.load(new URL('hand.glb', document.baseURI).href).catch(failed);
      })
      .catch(() => setMessage('This browser draws no 3-D here. The cards show every angle.'));
  });
  useEffect(() => {
    if (modelSide) choose(null);
  }, [modelSide]);
  useEffect(() => scene?.setSide(side), [scene, side]);
  useFrame('wear', () => {
    if (scene?.render(store.handPose(), qualitiesOf(state), store.bionicPose())) setMessage(null);
  });
  const drag = ({ clientX }: PointerEvent): void => {
    if (last_px.current === null) return;
    scene?.turn((last_px.current - clientX) * kTurn_radPerPx);
    last_px.current = clientX;
  };
  const drop = (): void => {
    last_px.current = null;
  };
  const turnByKey = (event: KeyboardEvent): void => {
    const turn_rad = { ArrowLeft: kTurn_rad, ArrowRight: -kTurn_rad }[event.key];
    if (turn_rad === undefined) return;
    event.preventDefault();
    scene?.turn(turn_rad);
  };
  const hasBionic = store.bionicPose() !== null;
  const isStill = state.fingers.length > 0 && state.fingers.every(({ angle_deg }) => angle_deg === null);
  return (
    <section class={`stage ${hasBionic ? 'two' : ''}`} aria-label="Hand">
      <div class="stage-canvas">
        <canvas
          role="img"
          tabindex={0}
          data-testid="hand-canvas"
          aria-label={wordsOf(state, side)}
          ref={canvas}
          onPointerDown={({ currentTarget, clientX, pointerId }) => {
            last_px.current = clientX;
            currentTarget.setPointerCapture(pointerId);
          }}
          onPointerMove={drag}
          onPointerUp={drop}
          onPointerCancel={drop}
          onKeyDown={turnByKey}
        />
      </div>
      <div class="stage-labels" aria-hidden="true">
        <span>{isStill ? 'Your hand, not calibrated: it stands still' : 'Your hand'}</span>
        <span hidden={!hasBionic}>{`Bionic hand${kHandWords[state.hand?.status ?? ''] ?? ''}`}</span>
      </div>
      <Note kind="stage-message" text={message} />
      <Note kind="stage-fault" text={faultsOf(state)} />
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

function qualitiesOf({ fingers }: State): Qualities {
  const out: Qualities = {};
  for (const { name, quality } of fingers) {
    const at = fingerOf(name);
    const ranks = [quality, at && out[at.finger]].map((of) => kQualities.indexOf(of ?? 'good'));
    if (at) out[at.finger] = kQualities[Math.max(...ranks)]!;
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

function faultsOf({ hand }: State): string {
  if (!hand) return '';
  const faults = hand.faults.map((text, i) => text && `${title(hand.names[i]!)}: ${text}`);
  return [...faults, hand.board].filter(Boolean).join(' ');
}
