// A card for each finger: angle with its uncertainty, quality, range covered, and the last seconds as a line.
import { useRef } from 'preact/hooks';
import { store, useFrame } from './app';
import { fingerColour, qualityWords } from './colours';
import { keep } from './kept';
import { Meter, Note, QualityShape } from './parts';
import type { Finger } from './state';
import { degrees, number, percent, title } from './text';

function Card({ finger, channel }: { finger: Finger; channel: number }) {
  const { name, raw, unit, sd_deg, covered, quality, remark, tracked } = finger;
  const [angle, closed, trace] = [
    useRef<HTMLSpanElement>(null),
    useRef<HTMLSpanElement>(null),
    useRef<SVGPathElement>(null),
  ];
  useFrame('wear', () => {
    const angle_deg = store.latest_deg(channel);
    const share = closedShare(finger, angle_deg);
    angle.current!.textContent = degrees(store.called_deg(finger, angle_deg));
    closed.current!.textContent = share === null ? '' : `${percent(share)} closed`;
    trace.current!.setAttribute('d', lineOf(channel));
  });
  return (
    <article
      class="card"
      data-testid={`card-${name}`}
      aria-label={title(name)}
      style={{ '--finger': fingerColour(name) }}
    >
      <div class="card-head">
        <h3>{title(name)}</h3>
        <span class="card-quality" data-testid={`quality-${name}`}>
          <QualityShape quality={quality} />
          <span>{qualityWords(quality)}</span>
        </span>
      </div>
      <p class="card-value">
        <span class="card-angle" ref={angle} />
        <span class="card-sd">{sd_deg === null ? '' : `± ${degrees(sd_deg, 1)}`}</span>
        <span class="card-closed" data-testid={`closed-${name}`} ref={closed} />
      </p>
      <svg class="card-trace" viewBox={`0 -0.5 ${kTrace_s} 1`} preserveAspectRatio="none" aria-hidden="true">
        <path ref={trace} />
      </svg>
      <div class="card-range">
        <Meter share={covered} />
        <p class="card-foot">
          <span class="card-covered">{`Range ${percent(covered)}`}</span>
          <span class="card-raw" data-testid={`raw-${name}`} title={unit}>
            {raw === null ? '' : `raw ${number(raw)}`}
          </span>
        </p>
      </div>
      <Note kind="card-remark" text={remark} />
      <Note kind="card-tracked muted" text={tracked} />
    </article>
  );
}

// Of the way from the joint's open hand to its fist, whatever its angles are called; null: not known.
function closedShare({ open_deg, fist_deg }: Finger, angle_deg: number): number | null {
  if (open_deg === null || fist_deg === null || Number.isNaN(angle_deg)) return null;
  return Math.min(1, Math.max(0, (angle_deg - open_deg) / (fist_deg - open_deg)));
}

const kTrace_s = 6;
const kTracePoints = 80;

// The last seconds about the middle of a square as high as what they span; the reading where no angle is known.
function lineOf(channel: number): string {
  const { glove, state } = store;
  const n = state.fingers.length;
  if (glove.channels !== 2 * n) return '';
  const hasAngles = !Number.isNaN(glove.last(n + channel));
  const from_s = glove.newest_s - kTrace_s;
  const { t_s, value } = glove.slice(hasAngles ? n + channel : channel, from_s, glove.newest_s, kTracePoints);
  const seen = value.filter((v) => v !== null);
  const [least, most] = [Math.min(...seen), Math.max(...seen)];
  const room = Math.max(hasAngles ? 20 : 10, most - least) * 1.2;
  const points = value.map((v, i) => {
    const move = v === null ? '' : i === 0 || value[i - 1] === null ? 'M' : 'L';
    return move && `${move}${(t_s[i]! - from_s).toFixed(3)} ${(((least + most) / 2 - v!) / room).toFixed(4)}`;
  });
  return points.join('');
}

// What an open hand is called, in degrees.
function OpenHand() {
  const open = store.state.fingers.flatMap(({ open_deg }) => (open_deg === null ? [] : [number(open_deg)]));
  const change = (input: HTMLInputElement): void => {
    if (!input.checkValidity()) input.value = '';
    store.openHand_deg = input.value || null;
    keep('open_hand', input.value);
  };
  return (
    <div class="open-hand" hidden={open.length === 0}>
      <label for="open-hand">My open hand is</label>
      <input
        id="open-hand"
        type="number"
        min="-180"
        max="180"
        step="any"
        defaultValue={store.openHand_deg ?? ''}
        placeholder={[...new Set(open)].join(', ')}
        data-testid="open-hand"
        onChange={({ currentTarget }) => change(currentTarget)}
      />
      degrees
      <span class="muted">Left empty, as the model has it. What is recorded, scored and sent stays as it is.</span>
    </div>
  );
}

export function Cards() {
  const { fingers } = store.state;
  return (
    <section aria-label="Fingers">
      <div class="cards">
        {fingers.map((finger, channel) => (
          <Card key={finger.name} finger={finger} channel={channel} />
        ))}
      </div>
      <p class="empty" hidden={fingers.length > 0}>
        No finger is sensed yet. A card for each appears as soon as a glove sends.
      </p>
      <OpenHand />
    </section>
  );
}
