// Look: scopes, the link, scores, the twin, sessions and their replay, and writing a board.
import { useRef } from 'preact/hooks';
import { ask, drawLatency, store } from './app';
import { Button, Note, Options, Panel, Table, useAsk, useRange } from './parts';
import { Scopes } from './scopes';
import type { Session } from './state';
import { number, time } from './text';

export function Look() {
  return (
    <div class="look">
      <Replay />
      <Scopes />
      <Link />
      <div class="look-parts">
        <div class="look-column">
          <Scores />
          <Sessions />
        </div>
        <div class="look-column">
          <Twin />
          <Experiment />
          <Flash />
        </div>
      </div>
    </div>
  );
}

function Link() {
  const { link } = store.state;
  const drawn = drawLatency();
  const tiles = [
    ['Rate', 'rate', number(link.rate_hz, 0, ' Hz')],
    ['Read to sent', 'latency', number(link.latency_ms, 1, ' ms')],
    ['Message to screen', 'screen', number(drawn.median_ms, 0, ' ms')],
    ['Jitter of arrival', 'jitter', number(link.jitter_ms, 1, ' ms')],
    ['Frames lost', 'lost', link.lost === null ? 'not known' : number(link.lost)],
    ['Malformed', 'torn', number(link.torn)],
  ];
  const spread = `99th percentile ${number(drawn.p99_ms)} ms of ${drawn.frames} frames`;
  return (
    <Panel id="link" name="Link">
      <dl class="tiles">
        {tiles.map(([name, id, value]) => (
          <div class="tile">
            <dt>{name}</dt>
            <dd data-testid={`link-${id}`} title={id === 'screen' ? spread : undefined}>
              {value}
            </dd>
          </div>
        ))}
      </dl>
    </Panel>
  );
}

function Replay() {
  const { replay } = store.state;
  return (
    replay && (
      <Panel id="replay" name="Replay">
        <p class="lead">{replay.file}</p>
        <TimeLine {...replay} />
        <div class="row">
          <Button test="replay-play" act={() => ask('replay.play', { on: !store.state.replay?.playing })}>
            {replay.playing ? 'Pause' : 'Play'}
          </Button>
          <Button test="replay-leave" kind="quiet" act={() => ask('device.leave')}>
            Leave the replay
          </Button>
        </div>
      </Panel>
    )
  );
}

function TimeLine({ t_s, of_s }: { t_s: number; of_s: number }) {
  const request = useAsk();
  const { shown, range } = useRange(t_s, (to_s) => request('replay.seek', { t_s: to_s }), false);
  const clock = `${time(shown)} of ${time(of_s)}`;
  const name = 'Time in the recording';
  return (
    <>
      <input {...range} max={of_s} step={0.01} aria-label={name} aria-valuetext={clock} data-testid="replay-line" />
      <p class="facts">{clock}</p>
    </>
  );
}

const kSliders = [
  { part: 'slip_deg', name: 'Slip of the glove', unit: '°', min: -20, max: 20, step: 0.5, digits: 1, scale: 1 },
  { part: 'drift_deg_per_min', name: 'Drift', unit: '° a minute', min: 0, max: 10, step: 0.1, digits: 1, scale: 1 },
  { part: 'noise_counts', name: 'Noise', unit: ' counts', min: 0, max: 20, step: 0.5, digits: 1, scale: 1 },
  { part: 'loss', name: 'Radio loss', unit: ' %', min: 0, max: 50, step: 1, digits: 0, scale: 100 },
] as const;

function Twin() {
  const { twin } = store.state;
  if (!twin) return null;
  return (
    <Panel id="twin" name="Twin">
      <p class="muted">What goes wrong with real gloves, at will.</p>
      {kSliders.map((slider) => (
        <Slider key={slider.part} slider={slider} value={twin[slider.part]} />
      ))}
    </Panel>
  );
}

function Slider({ slider, value }: { slider: (typeof kSliders)[number]; value: number }) {
  const { part, name, unit, digits, scale, ...bounds } = slider;
  const request = useAsk();
  const { shown, range } = useRange(value * scale, (to) => request('twin.set', { [part]: to / scale }), true);
  const words = number(shown, digits, unit);
  const id = `twin-${part}`;
  return (
    <div class="slider">
      <label for={id}>{name}</label>
      <output for={id}>{words}</output>
      <input {...range} {...bounds} id={id} aria-valuetext={words} data-testid={id} />
    </div>
  );
}

const kScoreColumns = ['Label', 'Total', '', '1', '2', '3', '4', '5', '6'];

function Scores() {
  const label = useRef<HTMLInputElement>(null);
  const { scores, twin } = store.state;
  const most = Math.max(1, ...scores.map((s) => s.total_deg_s));
  const run = (): Promise<string | null> =>
    ask('score.run', { label: label.current!.value.trim() || (store.state.model?.name ?? 'raw') });
  return (
    <Panel id="scores" name="Scores" hidden={scores.length === 0 && twin === null}>
      <div class="row">
        <label for="score-label" class="sr">
          Label of the score
        </label>
        <input
          id="score-label"
          type="text"
          placeholder="raw, compensated …"
          maxlength={40}
          data-testid="score-label"
          ref={label}
        />
        <Button test="score-run" act={run}>
          Run six gestures
        </Button>
      </div>
      <div class="scroll" tabindex={0} role="region" aria-label="Scores" hidden={scores.length === 0}>
        <Table
          test="scores"
          kind="scores"
          caption="Integral of absolute error, degree seconds, gestures 1 to 6"
          columns={kScoreColumns}
        >
          {scores.map(({ label: name, total_deg_s, gestures_deg_s }) => (
            <tr data-testid="score-row">
              <th scope="row">{name}</th>
              <td class="total">{number(total_deg_s)}</td>
              <td class="bar-cell">
                <span class="bar" aria-hidden="true" style={{ width: `${(100 * total_deg_s) / most}%` }} />
              </td>
              {gestures_deg_s.map((deg_s) => (
                <td>{number(deg_s)}</td>
              ))}
            </tr>
          ))}
        </Table>
      </div>
      <Note kind="empty" text={!scores.length && 'No score yet. A score is the six gestures through what runs now.'} />
    </Panel>
  );
}

function Experiment() {
  const trials = useRef<HTMLInputElement>(null);
  const { job, experiment } = store.state;
  const run = (): Promise<string | null> => ask('experiment.run', { trials: Number(trials.current!.value) });
  return (
    <Panel id="experiment" name="Experiment">
      <p class="muted">The published experiment in the simulator: six gestures, three compensators.</p>
      <div class="row">
        <label for="trials">Trials</label>
        <input
          id="trials"
          type="number"
          min={1}
          max={10000}
          defaultValue="10"
          data-testid="experiment-trials"
          ref={trials}
        />
        <Button test="experiment-run" act={run} disabled={job?.name === 'experiment'}>
          Run
        </Button>
      </div>
      {experiment && (
        <Table
          test="experiment-result"
          caption="Six gestures together, degree seconds, means"
          columns={['Compensator', 'Error']}
        >
          {experiment.map(({ compensator, total_deg_s }) => (
            <tr key={compensator}>
              <th scope="row">{compensator}</th>
              <td>{number(total_deg_s)}</td>
            </tr>
          ))}
        </Table>
      )}
    </Panel>
  );
}

function Sessions() {
  const { sessions } = store.state;
  return (
    <Panel id="sessions" name="Sessions">
      <ul class="sessions">
        {sessions.map(({ name, person, side, seconds, files }) => (
          <li key={name} data-testid="session">
            <div class="session-head">
              <strong>{name}</strong>
              <span class="muted">
                {[person, `${side} hand`, time(seconds)].filter(Boolean).join(', ')}
              </span>
              {logOf(files) && (
                <Button
                  test={`replay-${name}`}
                  kind="quiet"
                  act={() => ask('replay.open', { session: name, file: logOf(files) })}
                >
                  Replay
                </Button>
              )}
            </div>
            <ul class="files">
              {files.map((file) => (
                <li key={file}>
                  <a
                    href={['files', name, ...file.split('/')].map(encodeURIComponent).join('/')}
                    target="_blank"
                    rel="noopener"
                  >
                    {file}
                  </a>
                </li>
              ))}
            </ul>
          </li>
        ))}
      </ul>
      <Note kind="empty" text={!sessions.length && 'No session yet. A recording or a calibration makes one.'} />
    </Panel>
  );
}

// What can be replayed of a session: the program lists its log first.
const logOf = (files: Session['files']): string | undefined =>
  files.find((name) => name.endsWith('.csv') && !name.startsWith('markers'));

function Flash() {
  const board = useRef<HTMLSelectElement>(null);
  const port = useRef<HTMLSelectElement>(null);
  const { ports, device, twin } = store.state;
  if (twin && device.status !== 'boards') return null; // a twin without boards
  const write = (): Promise<string | null> =>
    ask('flash', { board: board.current!.value, ...(port.current!.value ? { port: port.current!.value } : {}) });
  return (
    <Panel id="flash" name="Flash a board">
      <p class="muted">
        Makes firmware of the model that is worn, for the pins of the wiring table and without tracking, and writes it
        through the board’s bootloader. For another wiring: flexor deploy, then flexor flash.
      </p>
      <div class="row">
        <div class="field">
          <label for="flash-board">Board</label>
          <select id="flash-board" ref={board}>
            <option value="glove">Glove</option>
            <option value="hand">Hand</option>
          </select>
        </div>
        <div class="field">
          <label for="flash-port">Port</label>
          <select id="flash-port" ref={port}>
            <option value="">Where it was found</option>
            <Options of={ports.map(({ path }) => [path, path])} />
          </select>
        </div>
      </div>
      <div class="row">
        <Button test="flash" act={write}>
          Write the board
        </Button>
      </div>
      <Note text={!ports.length && 'No port is there. Plug in a board.'} />
    </Panel>
  );
}
