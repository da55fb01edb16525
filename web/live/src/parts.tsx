// What the page is built of: panels, tables, controls that ask the program for something, and the line on what went wrong.
import { createContext, type ComponentChildren } from 'preact';
import { useContext, useState } from 'preact/hooks';
import { ask } from './app';
import { kShapes } from './colours';
import type { Quality } from './state';
import { title } from './text';

type Report = (error: string | null) => void;
const Line = createContext<Report>(() => {});

// Controls with one line under them on what went wrong.
export function Controls({ id, children }: { id: string; children: ComponentChildren }) {
  const [wrong, report] = useState<string | null>(null);
  return (
    <Line.Provider value={report}>
      {children}
      <Wrong id={id} text={wrong} />
    </Line.Provider>
  );
}

export function Wrong({ id, text }: { id: string; text: string | null }) {
  return (
    <p class="error" role="alert" data-testid={`${id}-error`} hidden={text === null}>
      {text}
    </p>
  );
}

// A line that is there while it has text.
export function Note({ kind = 'muted', text }: { kind?: string; text: string | false | null }) {
  return (
    <p class={kind} hidden={!text}>
      {text}
    </p>
  );
}

// Asks the program for something; what went wrong stands in the line of the controls.
export function useAsk(): (what: string, parts?: Record<string, unknown>) => Promise<void> {
  const report = useContext(Line);
  return async (what, parts) => report(await ask(what, parts));
}

// What a range is dragged to until the program has it. `take` gets it at each move, or only once it is let go.
export function useRange(value: number, take: (to: number) => Promise<void>, isLive: boolean) {
  const [held, hold] = useState<number | null>(null);
  const range = {
    type: 'range' as const,
    value: held ?? value,
    onInput: ({ currentTarget }: { currentTarget: HTMLInputElement }): void => {
      hold(Number(currentTarget.value));
      if (isLive) void take(Number(currentTarget.value));
    },
    onChange: ({ currentTarget }: { currentTarget: HTMLInputElement }): void => {
      const to = Number(currentTarget.value);
      void take(to).then(() => hold((now) => (now === to ? null : now))); // unless it has been dragged on
    },
  };
  return { shown: held ?? value, range };
}

interface ButtonOptions {
  test: string;
  act: () => Promise<string | null> | void;
  kind?: string; // primary, quiet, small
  label?: string; // where a sign stands on it
  pressed?: boolean;
  disabled?: boolean;
  hidden?: boolean;
  children: ComponentChildren;
}

// It waits while it waits, and what went wrong stands in its line.
export function Button({ test, act, kind = '', label, pressed, disabled = false, hidden, children }: ButtonOptions) {
  const [busy, setBusy] = useState(false);
  const report = useContext(Line);
  const click = async (): Promise<void> => {
    if (busy) return;
    const answer = act();
    if (!answer) return;
    setBusy(true);
    report(null);
    report(await answer);
    setBusy(false);
  };
  return (
    <button
      type="button"
      class={`button ${kind}`}
      data-testid={test}
      aria-label={label}
      title={label}
      aria-pressed={pressed}
      aria-busy={busy || undefined}
      disabled={disabled && !busy}
      hidden={hidden}
      onClick={() => void click()}
    >
      {children}
    </button>
  );
}

// What a list offers: its value, and what it is called.
export function Options({ of }: { of: readonly (readonly [string, string])[] }) {
  return of.map(([value, name]) => (
    <option key={value} value={value}>
      {name}
    </option>
  ));
}

interface SwitchOptions {
  test: string;
  on: boolean;
  disabled?: boolean;
  turn: (on: boolean) => void;
  children: ComponentChildren;
}

export function Switch({ test, on, disabled = false, turn, children }: SwitchOptions) {
  return (
    <button
      type="button"
      role="switch"
      class="switch"
      data-testid={test}
      aria-checked={on}
      disabled={disabled}
      onClick={() => turn(!on)}
    >
      <span class="switch-knob" aria-hidden="true" />
      {children}
    </button>
  );
}

interface SegmentedOptions<T> {
  name: string;
  test: string; // of each with its value
  values: readonly T[];
  pressed: T | null | undefined;
  pick: (value: T) => void;
  write?: (value: T) => string;
}

// Buttons of which one is pressed.
export function Segmented<T extends string | number>(options: SegmentedOptions<T>) {
  const { name, test, values, pressed, pick, write = (value: T) => title(String(value)) } = options;
  return (
    <div class="segmented" role="group" aria-label={name}>
      {values.map((value) => (
        <button
          key={value}
          type="button"
          data-testid={`${test}-${value}`}
          aria-pressed={value === pressed}
          onClick={() => pick(value)}
        >
          {write(value)}
        </button>
      ))}
    </div>
  );
}

interface PanelOptions {
  id: string;
  name: string;
  kind?: string;
  hidden?: boolean;
  beside?: ComponentChildren; // the heading
  children: ComponentChildren;
}

// A part of a place, called by its heading, with a line on what went wrong in it.
export function Panel({ id, name, kind = '', hidden, beside, children }: PanelOptions) {
  const heading = <h2 id={`${id}-title`}>{name}</h2>;
  return (
    <section class={`panel part-${id} ${kind}`} aria-labelledby={`${id}-title`} hidden={hidden}>
      <Controls id={id}>
        {beside === undefined ? (
          heading
        ) : (
          <div class="panel-head">
            {heading}
            {beside}
          </div>
        )}
        {children}
      </Controls>
    </section>
  );
}

interface TableOptions {
  test: string;
  caption: string;
  columns: readonly string[]; // an empty name is a column without a heading
  kind?: string;
  children: ComponentChildren; // rows
}

export function Table({ test, caption, columns, kind = '', children }: TableOptions) {
  return (
    <table class={`table ${kind}`} data-testid={test}>
      <caption>{caption}</caption>
      <thead>
        <tr>{columns.map((name) => (name === '' ? <td /> : <th scope="col">{name}</th>))}</tr>
      </thead>
      <tbody>{children}</tbody>
    </table>
  );
}

// Of a share, in the colour of its finger.
export function Meter({ share }: { share: number | null }) {
  const width = `${Math.round(Math.min(1, Math.max(0, share ?? 0)) * 100)}%`;
  return (
    <span class="meter" aria-hidden="true">
      <span class="meter-fill" style={{ width }} />
    </span>
  );
}

export function QualityShape({ quality }: { quality: Quality }) {
  return (
    <svg viewBox="0 0 16 16" class={`quality quality-${quality}`} aria-hidden="true">
      <path d={kShapes[quality]} class={quality === 'none' ? 'hollow' : undefined} />
    </svg>
  );
}
