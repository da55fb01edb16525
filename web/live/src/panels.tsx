// What one does while wearing: record, connect, choose a model and send it, put the glove on again.
import { useRef } from 'preact/hooks';
import { ask, store } from './app';
import { kFingers } from './mapping';
import { Button, Controls, Note, Options, Panel, Switch, Table, useAsk } from './parts';
import type { Device } from './state';
import { degrees, number, time, title } from './text';
import { refusalWords } from './words';

export const kStatus: Record<Device['status'], string> = {
  none: 'No glove',
  listening: 'Listening',
  glove: 'Glove connected',
  gone: 'Unplugged',
  replay: 'Replaying a recording',
  twin: 'Simulated glove',
  boards: 'Simulated boards',
};

export function Glove() {
  const port = useRef<HTMLSelectElement>(null);
  const { device, ports } = store.state;
  const isHere = !['none', 'gone'].includes(device.status);
  const facts = isHere ? [device.port, device.format].filter((fact) => fact && !device.says.includes(fact)) : [];
  const leave = isHere && (
    <Button test="device-leave" kind="quiet" act={() => ask('device.leave')}>
      Disconnect
    </Button>
  );
  return (
    <Panel id="glove" name="Glove" beside={leave}>
      <p class="lead">{`${kStatus[device.status]}: ${device.name}`}</p>
      <Note text={device.says} />
      <Note kind="facts" text={facts.join(' · ')} />
      <Names />
      <div class="row" hidden={isHere}>
        <select aria-label="Port" data-testid="port" ref={port}>
          <option value="auto">What is there</option>
          <Options of={ports.map(({ path, name }) => [path, `${path} (${name})`])} />
        </select>
        <Button test="device-connect" act={() => ask('device.connect', { port: port.current!.value })}>
          Connect
        </Button>
      </div>
    </Panel>
  );
}

// Which finger each column of a glove without names is: asked once, the program keeps it for that glove.
function Names() {
  const list = useRef<HTMLDivElement>(null);
  const chosen = (): string[] => [...list.current!.querySelectorAll('select')].map(({ value }) => value);
  const { next, fingers } = store.state;
  return (
    <div class="field" data-testid="names" hidden={next.kind !== 'name'}>
      <Controls id="names">
        <p>Its columns have no names. Bend one finger after the other: which reading moves? This is asked once.</p>
        <div class="names" ref={list}>
          {fingers.map(({ name }) => (
            <label key={name} class="row">
              <span>{title(name)}</span>
              <select data-testid={`name-${name}`}>
                <option value="">No finger</option>
                <Options of={kFingers.map((finger) => [finger, title(finger)])} />
              </select>
            </label>
          ))}
        </div>
        <div class="row">
          <Button test="names-save" kind="primary" act={() => ask('columns.name', { names: chosen() })}>
            These are the fingers
          </Button>
        </div>
      </Controls>
    </div>
  );
}

export function Record() {
  const { recording, device } = store.state;
  const isConnected = !['none', 'gone', 'listening'].includes(device.status);
  return (
    <Panel id="record" name="Record">
      <Button
        test="record"
        kind={`primary record ${recording ? 'on' : ''}`}
        act={() => ask(store.state.recording ? 'record.stop' : 'record.start')}
        disabled={!recording && !isConnected}
      >
        <span class="record-dot" aria-hidden="true" />
        <span>{recording ? `Stop ${time(recording.seconds)}` : 'Start recording'}</span>
      </Button>
      <Note text={recording && `${recording.rows} rows in ${recording.file}`} />
    </Panel>
  );
}

export function Model() {
  const { model, device } = store.state;
  const takesModels = ['glove', 'boards', 'twin'].includes(device.status);
  const hint = !model
    ? 'Choose a model, or calibrate, before there is something to send.'
    : takesModels
      ? ''
      : 'Needs a glove with Flexor’s program.';
  return (
    <Panel id="model" name="Person and model">
      <Models />
      <Button test="send" act={() => ask('send')} disabled={!model}>
        Send to the glove
      </Button>
      <Note text={hint} />
    </Panel>
  );
}

function Models() {
  const request = useAsk();
  const { model, models } = store.state;
  const known = model && !models.some((m) => m.path === model.path) ? [model, ...models] : models;
  const isTwice = (wanted: string): boolean => known.filter(({ name }) => name === wanted).length > 1;
  const select = useRef<HTMLSelectElement>(null);
  return (
    <select
      aria-label="Person and model"
      data-testid="model"
      ref={select}
      value={document.activeElement === select.current ? undefined : (model?.path ?? '')}
      onChange={({ currentTarget }) => void request('model.choose', { path: currentTarget.value || null })}
    >
      <option value="">No model: readings as they are</option>
      <Options of={known.map(({ path, name }) => [path, isTwice(name) ? `${name} (${path})` : name])} />
    </select>
  );
}

const kMotion = 'Open and close every finger for ten seconds. Nothing changes before you accept.';
const kPutOn = `Glove put on again? ${kMotion}`;
const kSlipped = `The glove has slipped: it reads otherwise than when it was calibrated. ${kMotion}`;
const kRedonningColumns = ['Finger', 'Off by', 'Verdict'];

export function Redonning() {
  const { anew, model, next } = store.state;
  const { seconds, of_seconds: of, fingers } = anew ?? { seconds: 0, of_seconds: 10, fingers: [] };
  const isDone = fingers.length > 0;
  const isRunning = !isDone && seconds > 0 && seconds < of;
  const isSlipped = next.kind === 'slipped';
  const control = (label: string, word: string, kind: string, disabled = false) => (
    <Button test={`anew-${word}`} kind={kind} act={() => ask(`anew.${word}`)} disabled={disabled}>
      {label}
    </Button>
  );
  return (
    <Panel id="anew" name="Put on again" kind={isSlipped ? 'offered' : ''}>
      <Note text={!isRunning && !isDone && (isSlipped ? kSlipped : kPutOn)} />
      {!isDone && control('Ten seconds of motion', 'start', isSlipped ? 'primary' : '', !model || isRunning)}
      <progress
        max={of}
        value={Math.min(of, seconds)}
        aria-label="Seconds of motion"
        data-testid="anew-progress"
        hidden={!isRunning}
      />
      <Note kind="facts" text={isRunning && `Keep moving: ${number(seconds)} of ${number(of)} s`} />
      {isDone && (
        <Table test="anew-table" caption="How far off, degrees, by the new calibration" columns={kRedonningColumns}>
          {fingers.map(({ name, before_deg, after_deg, verdict }) => {
            const error = after_deg === null ? '' : `± ${degrees(after_deg, 1)}`;
            return (
              <tr key={name} data-testid={`anew-${name}`}>
                <th scope="row">{title(name)}</th>
                <td>{before_deg === null ? 'not known' : `${degrees(before_deg, 1)} ${error}`}</td>
                <td class="wrap">{verdict}</td>
              </tr>
            );
          })}
        </Table>
      )}
      {isDone && (
        <div class="row">
          {control('Accept', 'accept', 'primary')}
          {control('Keep as it was', 'keep', 'quiet')}
        </div>
      )}
      <Tracking />
    </Panel>
  );
}

function Tracking() {
  const request = useAsk();
  const { tracking, tracking_remark: why } = store.state;
  return (
    <div>
      <Switch test="tracking" on={tracking} disabled={!!why} turn={(on) => void request('tracking.set', { on })}>
        Follow slow changes while worn
      </Switch>
      <Note text={refusalWords(why)} />
    </div>
  );
}
