// The page of `flexor live`: three places, one socket. What it shows is the program's; it keeps nothing that must not be lost.
import './style.css';
import { render } from 'preact';
import { useMemo } from 'preact/hooks';
import { ask, go, kPlaces, place, start, store, type PlaceName } from './app';
import { Calibrate } from './calibrate';
import { Look } from './look';
import { Cards } from './cards';
import { Glove, kStatus, Model, Record, Redonning } from './panels';
import { Button, Controls } from './parts';
import { Stage } from './stage';
import { progressOf, title } from './text';
import { nextWords, refusalWords } from './words';

const kElements: Record<PlaceName, () => preact.JSX.Element> = { wear: Wear, calibrate: Calibrate, look: Look };

// The hand, what to do next, a card for each finger, and what one does while wearing.
function Wear() {
  return (
    <div class="wear">
      <div class="wear-main">
        <Stage />
        <Cards />
      </div>
      <div class="wear-side">
        <Record />
        <Glove />
        <Model />
        <Redonning />
      </div>
    </div>
  );
}

function Page() {
  const { state, isLost } = store;
  return (
    <>
      <a class="skip" href="#main">
        To the content
      </a>
      <header class="top">
        <h1 class="brand">
          <img src="./icon.svg" alt="" width={28} height={28} />
          Flexor
        </h1>
        <Tabs />
        <Status />
      </header>
      <main id="main" class="main">
        <p class="lost" role="alert" data-testid="lost" hidden={!isLost}>
          The program does not answer. Trying again …
        </p>
        <Job />
        <p class="next" data-testid="next" aria-live="polite" hidden={place !== 'wear'}>
          {nextWords(state.next, state)}
        </p>
        {kPlaces.map((name) => {
          const Element = kElements[name];
          return (
            <div
              key={name}
              role="tabpanel"
              id={`place-${name}`}
              class="place"
              tabindex={-1}
              aria-labelledby={`tab-${name}`}
              hidden={place !== name}
            >
              <Element />
            </div>
          );
        })}
      </main>
      <div class="sr" aria-live="polite" role="status">
        {store.announced}
      </div>
    </>
  );
}

function Tabs() {
  const move = (event: KeyboardEvent): void => {
    const at = kPlaces.indexOf(place);
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: kPlaces.length - 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    const name = kPlaces[(to + kPlaces.length) % kPlaces.length]!;
    go(name);
    document.getElementById(`tab-${name}`)!.focus();
  };
  return (
    <div class="tabs" role="tablist" aria-label="Places" onKeyDown={move}>
      {kPlaces.map((name) => (
        <button
          key={name}
          type="button"
          role="tab"
          id={`tab-${name}`}
          class={`tab ${name === 'calibrate' && store.state.calibration ? 'busy' : ''}`}
          aria-controls={`place-${name}`}
          aria-selected={place === name}
          tabindex={place === name ? 0 : -1}
          data-testid={`tab-${name}`}
          onClick={() => go(name)}
        >
          {title(name)}
        </button>
      ))}
    </div>
  );
}

const kDots: Record<string, string> = { none: 'none', gone: 'off', listening: 'wait' };

function Status() {
  const { device } = store.state;
  const dot = store.connected ? (kDots[device.status] ?? 'on') : 'off';
  return (
    <p class="status" data-testid="status">
      <span class={`dot dot-${dot}`} aria-hidden="true" />
      <span>{store.connected ? kStatus[device.status] : 'Not connected'}</span>
    </p>
  );
}

// What runs, or for a while how the last job ended.
function Job() {
  const { job, last } = store.state;
  const ended_ms = useMemo(() => performance.now(), [JSON.stringify(last)]);
  const isFresh = last !== null && performance.now() - ended_ms < (last.ok ? 8000 : 30000);
  const text = job
    ? `${title(job.name)}: ${progressOf(job)}`
    : last && `${last.ok ? '✓' : '✕'} ${title(last.job)}: ${refusalWords(last.text)}`;
  return (
    <div class={`job ${!job && last?.ok === false ? 'failed' : ''}`} hidden={!job && !isFresh}>
      <Controls id="strip">
        <span class="job-text" data-testid="job">
          {text}
        </span>
        {job && (
          <progress key={job.fraction === null} max={1} value={job.fraction ?? undefined} aria-label="Share that is done" />
        )}
        {job && (
          <Button test="strip-cancel" kind="quiet" act={() => ask('job.cancel')}>
            Stop
          </Button>
        )}
      </Controls>
    </div>
  );
}

const root = document.querySelector('#app')!;
start(() => render(store.state ? <Page /> : <p class="next main">Connecting to the program …</p>, root));
