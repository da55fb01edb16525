// Calibrate: from a glove on the hand to a proven model, step by step. The steps are the server's; here they are shown.
import { useEffect, useState } from 'preact/hooks';
import { ask, go, store } from './app';
import { Camera } from './camera';
import { fingerColour } from './colours';
import { Button, Controls, Meter, Switch } from './parts';
import { Result } from './result';
import { beep, isLoud, setLoud, wakeSound } from './sound';
import { Start } from './start';
import { kSteps, type Calibration, type Coverage } from './state';
import { percent, time, title } from './text';
import { askWords, missingWords } from './words';

export function Calibrate() {
  const { calibration } = store.state;
  return (
    <div class="calibrate" onClick={wakeSound}>
      <Steps calibration={calibration} />
      <Start hidden={calibration !== null} />
      {calibration && <Work calibration={calibration} />}
    </div>
  );
}

function Steps({ calibration }: { calibration: Calibration | null }) {
  const now = calibration ? kSteps.indexOf(calibration.step) : -1;
  return (
    <ol class="steps" aria-label="Steps of the calibration">
      {kSteps.map((step, i) => (
        <li
          data-testid={`step-${step}`}
          class={i < now ? 'done' : undefined}
          aria-current={i === now ? 'step' : undefined}
        >
          <span class="step-number" aria-hidden="true">
            {i + 1}
          </span>
          <span class="step-name">{title(step)}</span>
          <span class="sr">{i < now && ', done'}</span>
        </li>
      ))}
    </ol>
  );
}

function Work({ calibration }: { calibration: Calibration }) {
  const { step, camera, seconds, of_seconds, left_s, then } = calibration;
  const [loud, setLoudness] = useState(isLoud());
  const isMotion = step === 'motion';
  const asks = isMotion ? calibration.asks : null;
  useEffect(() => {
    if (asks) beep();
  }, [asks]);
  const turn = (on: boolean): void => {
    setLoud(on);
    setLoudness(on);
  };
  const left = left_s === null ? '' : `${Math.ceil(left_s)} s`;
  const isFilmed = camera !== 'none' && (step === 'reference' || isMotion);
  return (
    <section class={`panel work ${isFilmed ? 'with-camera' : ''}`} aria-label="The step">
      <div class="work-main">
        <p class="instruction" aria-live="polite" data-testid="calibrate-say">
          {askWords(calibration.asks, calibration)}
        </p>
        <div class="clock" hidden={!isMotion}>
          <p class="lead" data-testid="calibrate-then">
            {left && (then ? `In ${left}: ${askWords(then, calibration)}` : `${left} more`)}
          </p>
          <progress max={of_seconds} value={Math.min(of_seconds, seconds)} aria-label="Time in this step" />
          <p class="facts">{seconds > of_seconds ? time(seconds) : `${time(seconds)} of ${time(of_seconds)}`}</p>
          <Switch test="sound" on={loud} turn={turn}>
            A tone at each change
          </Switch>
        </div>
        <Result calibration={calibration} />
        <Covered covered={calibration.covered} hidden={!isMotion} />
        <Nav calibration={calibration} />
      </div>
      <Camera calibration={calibration} isFilmed={isFilmed} />
    </section>
  );
}

const kCovered = { range: 'Bends', slow: 'Slow', fast: 'Fast', holds: 'Holds' } as const;

function Covered({ covered, hidden }: { covered: Coverage[]; hidden: boolean }) {
  const part = (finger: Coverage, of: keyof typeof kCovered) => {
    const share = finger[of];
    return (
      <span class={`part part-${of} ${share >= 0.995 ? 'full' : ''}`}>
        <span class="part-name">{kCovered[of]}</span>
        <Meter share={share} />
        <span class="part-share">{share >= 0.995 ? '✓' : percent(share)}</span>
      </span>
    );
  };
  return (
    <div hidden={hidden}>
      <h3>What has been covered</h3>
      <ul class="coverage">
        {covered.map((finger) => (
          <li key={finger.name} style={{ '--finger': fingerColour(finger.name) }}>
            <strong>{title(finger.name)}</strong>
            {(['range', 'slow', 'fast', 'holds'] as const).map((of) => part(finger, of))}
            <span class="missing" data-testid={`missing-${finger.name}`}>
              {missingWords(finger.missing)}
            </span>
          </li>
        ))}
      </ul>
    </div>
  );
}

function Nav({ calibration: { step, failed, asks } }: { calibration: Calibration }) {
  const control = (label: string, word: string, kind = '', disabled = false) => (
    <Button
      key={word}
      test={`calibrate-${word}`}
      kind={kind}
      disabled={disabled}
      act={() => (word === 'send' ? ask('send') : word === 'next' ? next() : ask(`calibrate.${word}`))}
    >
      {label}
    </Button>
  );
  const next = async (): Promise<string | null> => {
    const wrong = await ask('calibrate.next');
    if (step === 'send' && wrong === null) go('wear');
    return wrong;
  };
  const isOver = step === 'result' || (step === 'identify' && !!failed);
  const isUnseen = step === 'reference' && asks !== 'seen';
  const isBusy = step === 'identify' && store.state.job !== null;
  const isSend = step === 'send';
  return (
    <Controls id="calibrate">
      <div class="row nav">
        {step === 'result' && control('Accept', 'accept', 'primary')}
        {isSend && control('Send to the glove', 'send', 'primary')}
        {!isOver && control(isSend ? 'Finish' : 'Next', 'next', isSend ? '' : 'primary', isUnseen || isBusy)}
        {isOver && control('Repeat the motion', 'repeat')}
        {step !== 'glove' && control('Back', 'back')}
        {control('Cancel', 'cancel', 'quiet')}
      </div>
    </Controls>
  );
}
