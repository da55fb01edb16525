// Scopes: for each finger the reading and, beside it, the angle that the compensator makes of it, over the last minute.
import { useLayoutEffect, useReducer, useRef, useState } from 'preact/hooks';
import { ask, place as shownPlace, store, useFrame } from './app';
import { fingerColour } from './colours';
import { Button, Controls, Note, Panel, Segmented } from './parts';
import { axis, css, usePlot, type Plot, type PlotData, type PlotOptions } from './plots';
import type { Finger } from './state';
import { degrees, number, title } from './text';
import { TimeWindow } from './time_window';

const kWindows_s = [5, 15, 60];
const kHeight_px = 132;
const kLeastBetween_ms = 30; // plots need no more than 30 pictures a second
const kColumns = 640; // of each at most the least and the greatest row
const kBeyond_s = 0.5; // rows beyond the edges, so that lines reach them

const oldest_s = (): number => store.glove.oldest_s;

export function Scopes() {
  const [window] = useState(() => new TimeWindow());
  const [hidden, hide] = useState<readonly string[]>([]); // fingers
  const [, count] = useReducer((n: number) => n + 1, 0);
  const wasShown = useRef(false);
  wasShown.current ||= shownPlace === 'look';
  // The window, by whatever hand.
  const change = (act: () => void): void => {
    act();
    count(undefined);
  };
  const { fingers } = store.state;
  const isHidden = ({ name }: Finger): boolean => hidden.includes(name);
  const turn = ({ name }: Finger): void =>
    hide((before) => (before.includes(name) ? before.filter((other) => other !== name) : [...before, name]));
  const chips = (
    <div class="chips" role="group" aria-label="Fingers in the scopes">
      {fingers.map((finger) => (
        <button
          key={finger.name}
          type="button"
          class="chip"
          aria-pressed={!isHidden(finger)}
          style={{ '--finger': fingerColour(finger.name) }}
          onClick={() => turn(finger)}
        >
          <span class="swatch" aria-hidden="true" />
          {title(finger.name)}
        </button>
      ))}
    </div>
  );
  return (
    <Panel id="scopes" name="Scopes" beside={chips}>
      <Toolbar window={window} change={change} />
      <p class="muted hint">Draw across a scope to zoom in. Raw on the left, compensated on the right.</p>
      <div class="scopes">
        {wasShown.current &&
          fingers.flatMap((finger, channel) =>
            isHidden(finger)
              ? []
              : (['raw', 'angle'] as const).map((kind) => (
                  <Scope key={`${finger.name} ${kind}`} {...{ finger, channel, kind, window, change }} />
                )),
          )}
      </div>
      <Note kind="empty" text={fingers.length === 0 && 'Nothing has been sent yet.'} />
    </Panel>
  );
}

interface WindowOptions {
  window: TimeWindow;
  change(act: () => void): void;
}

function Toolbar({ window, change }: WindowOptions) {
  const note = useRef<HTMLInputElement>(null);
  const { paused, span_s } = window;
  const setMarker = async (): Promise<string | null> => {
    const wrong = await ask('marker', { text: note.current!.value.trim() || 'marker' });
    if (wrong === null) note.current!.value = '';
    return wrong;
  };
  const tool = (sign: string, name: string, test: string, act: () => void) => (
    <Button test={test} kind="small" label={name} act={() => change(act)}>
      {sign}
    </Button>
  );
  return (
    <Controls id="marker">
      <div class="row toolbar">
        <Button test="scope-pause" pressed={paused} act={() => change(() => (paused ? window.run() : window.pause()))}>
          {paused ? 'Go on' : 'Pause'}
        </Button>
        <Segmented
          name="Width of the scopes"
          test="window"
          values={kWindows_s}
          pressed={paused ? null : span_s}
          pick={(s) => change(() => window.run(s))}
          write={(s) => `${s} s`}
        />
        <div class="row tools">
          {tool('−', 'Zoom out', 'scope-out', () => window.zoom(1.6, oldest_s()))}
          {tool('+', 'Zoom in', 'scope-in', () => window.zoom(1 / 1.6, oldest_s()))}
          {tool('←', 'Earlier', 'scope-earlier', () => window.pan(-0.25, oldest_s()))}
          {tool('→', 'Later', 'scope-later', () => window.pan(0.25, oldest_s()))}
        </div>
        <span class="marker-field">
          <label for="marker-text" class="sr">
            Text of the marker
          </label>
          <input
            type="text"
            id="marker-text"
            placeholder="what happened"
            maxlength={80}
            data-testid="marker-text"
            ref={note}
          />
          <Button test="marker" act={setMarker}>
            Set marker
          </Button>
        </span>
      </div>
    </Controls>
  );
}

interface ScopeOptions extends WindowOptions {
  finger: Finger;
  channel: number;
  kind: 'raw' | 'angle';
}

function Scope({ finger, channel, kind, window, change }: ScopeOptions) {
  const { name, unit } = finger;
  const value = useRef<HTMLSpanElement>(null);
  const colour = fingerColour(name);
  const select = (drawn: Plot): void => {
    const { left, width } = drawn.select;
    if (width < 4) return; // a click
    const [from_s, to_s] = [drawn.posToVal(left, 'x'), drawn.posToVal(left + width, 'x')];
    drawn.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    change(() => window.look(from_s, to_s, oldest_s()));
  };
  const options = (): PlotOptions => ({
    padding: [6, 16, 0, 0],
    scales: { x: { time: false, range: () => [window.from_s, window.to_s] } },
    axes: [
      axis({
        size: 22,
        space: 64,
        splits: (_plot, _axis, from_s, to_s, step_s) => window.ticks(from_s, to_s, step_s),
        values: (_plot, ticks) => ticks.map((t_s) => window.label(t_s)),
      }),
      axis({ size: 40, space: 28 }),
    ],
    cursor: { sync: { key: 'scopes' }, drag: { x: true, y: false, setScale: false }, points: { size: 6 } },
    series: [{}, { stroke: colour, width: 1.5, spanGaps: false, points: { show: false } }],
    hooks: { draw: [drawMarkers], setSelect: [select] },
  });
  const row = (): number => (kind === 'raw' ? channel : store.state.fingers.length + channel); // of the ring
  const written = (v: number): number => (kind === 'raw' ? v : store.called_deg(store.state.fingers[channel], v));
  const data = (): PlotData => {
    if (row() >= store.glove.channels) return [[], []];
    const [from_s, to_s] = [window.from_s - kBeyond_s, window.to_s + kBeyond_s];
    const { t_s, value: values } = store.glove.slice(row(), from_s, to_s, kColumns);
    return [t_s, values.map((v) => (v === null ? null : written(v)))];
  };
  const { place, plot } = usePlot(`${channel} ${unit}`, kHeight_px, options, data);
  const last_ms = useRef(0);
  const draw = (): void => {
    if (store.glove.rows > 0) window.advance(store.glove.newest_s);
    plot.current?.setData(data());
    if (window.paused || row() >= store.glove.channels) return;
    const latest = written(store.glove.last(row()));
    value.current!.textContent = kind === 'raw' ? number(latest) : degrees(latest);
  };
  useFrame('look', (now_ms) => {
    if (window.paused || now_ms - last_ms.current < kLeastBetween_ms) return;
    last_ms.current = now_ms;
    draw();
  });
  // Also where it stands: the window is another one.
  useLayoutEffect(() => {
    if (shownPlace === 'look') draw();
  });
  return (
    <div class="scope" style={{ '--finger': colour }}>
      <p class="scope-head">
        <span class="swatch" aria-hidden="true" />
        <strong>{title(name)}</strong>
        {kind === 'raw' ? `raw, ${unit ?? 'reading'}` : 'compensated, degrees'}
        <span class="scope-value" data-testid={`scope-${kind}-${name}`} ref={value} />
      </p>
      <div
        class="plot"
        role="img"
        aria-label={`${title(name)}, ${kind === 'raw' ? 'reading' : 'angle'} over time`}
        ref={place}
      />
    </div>
  );
}

function drawMarkers(plot: Plot): void {
  const { ctx: c, bbox } = plot;
  const ratio = window.devicePixelRatio;
  c.save();
  c.strokeStyle = c.fillStyle = css('--ink');
  c.lineWidth = ratio;
  c.setLineDash([3 * ratio, 3 * ratio]);
  c.font = `${11 * ratio}px ${css('--font')}`;
  c.textBaseline = 'top';
  c.textAlign = 'left';
  for (const { host_s, text } of store.markers) {
    const x = Math.round(plot.valToPos(host_s, 'x', true));
    if (x < bbox.left || x > bbox.left + bbox.width) continue;
    c.beginPath();
    c.moveTo(x, bbox.top);
    c.lineTo(x, bbox.top + bbox.height);
    c.stroke();
    c.fillText(text.slice(0, 24), x + 4 * ratio, bbox.top + 2 * ratio);
  }
  c.restore();
}
