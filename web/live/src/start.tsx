// Before a calibration: who, which hand, and what measures the true angle.
import { useRef, useState } from 'preact/hooks';
import { ask, store } from './app';
import { kHasMarkerless } from './markerless';
import { Marks } from './marks';
import { Button, Controls, Options } from './parts';
import type { Reference, Side } from './state';
import { title } from './text';

interface Choice<T> {
  value: T;
  name: string;
  text?: string;
  disabled?: boolean;
}

const kReferences: Choice<Reference>[] = [
  {
    value: 'marks',
    name: 'Coloured marks and a webcam',
    text: 'The best reference: dots on the joints, seen by a camera. Each finger is measured by itself.',
  },
  {
    value: 'poses',
    name: 'Poses alone',
    text: 'No camera: the open hand and a fist, twice. A straight line for each finger, about 20 degrees off, in a minute.',
  },
  {
    value: 'markerless',
    name: 'A webcam without marks',
    text: kHasMarkerless
      ? 'Convenient, not exact. Seen from the side: off by about 14 degrees at the knuckles and 13 at the middle joints. Seen otherwise: 20 and more. Marks are the better reference.'
      : 'This page carries no model for it: the Python wheel leaves it out, and a build of the sources has it or states why not.',
    disabled: !kHasMarkerless,
  },
  {
    value: 'drawn',
    name: 'The drawn hand',
    text: 'With the simulated glove: its own hand, drawn, is what the camera sees.',
  },
];

const kSides: Choice<Side>[] = (['left', 'right'] as const).map((value) => ({ value, name: title(value) }));
const kFirstJoints = 'paper_hand'; // all five fingers

export function Start({ hidden }: { hidden: boolean }) {
  const person = useRef<HTMLInputElement>(null);
  const { joint_files, model, models, twin } = store.state;
  const [chosenSide, chooseSide] = useState<Side | null>(null);
  const [chosenReference, chooseReference] = useState<Reference | null>(null);
  const [joints, chooseJoints] = useState(kFirstJoints);
  const side = chosenSide ?? model?.side ?? 'right'; // as `flexor deploy`
  const reference = chosenReference ?? (twin ? 'drawn' : 'marks');
  const start = (): Promise<string | null> => {
    const name = person.current!.value.trim();
    if (name === '') {
      person.current!.focus();
      return Promise.resolve('Write a name first: calibrations are kept for each person.');
    }
    const marks = reference === 'marks' ? { joints } : {};
    return ask('calibrate.start', { person: name, side, reference, ...marks });
  };
  const people = new Set(models.map((m) => m.person).filter(Boolean));
  return (
    <section class="panel start" aria-labelledby="start-title" hidden={hidden}>
      <h2 id="start-title" class="big">
        Teach the glove your hand
      </h2>
      <p class="muted">
        Three minutes with a camera, one without. You can leave at any step and come back: the steps stay where they
        were.
      </p>
      <div class="field">
        <label for="person">Name</label>
        <input
          id="person"
          type="text"
          list="people"
          autocomplete="off"
          spellcheck={false}
          data-testid="calibrate-person"
          placeholder="anna"
          ref={person}
        />
        <datalist id="people">
          <Options of={[...people].map((name) => [name, ''])} />
        </datalist>
      </div>
      <Choices name="side" legend="Hand" choices={kSides} chosen={side} choose={chooseSide} />
      <Choices
        name="reference"
        legend="What measures the true angle"
        choices={kReferences.filter(({ value }) => value !== 'drawn' || twin !== null)}
        chosen={reference}
        choose={chooseReference}
      />
      <div class="field" hidden={reference !== 'marks'}>
        <label for="joints">Where the marks are</label>
        <select id="joints" value={joints} onChange={({ currentTarget }) => chooseJoints(currentTarget.value)}>
          <Options of={joint_files.map((name) => [name, title(name)])} />
        </select>
        <Marks test="marks-chosen" joints={joints} />
      </div>
      <Controls id="calibrate-start">
        <div class="row">
          <Button test="calibrate-start" kind="primary" act={start}>
            Start calibration
          </Button>
        </div>
      </Controls>
    </section>
  );
}

interface ChoicesOptions<T> {
  name: string;
  legend: string;
  choices: Choice<T>[];
  chosen: T;
  choose: (value: T) => void;
}

function Choices<T extends string>({ name, legend, choices, chosen, choose }: ChoicesOptions<T>) {
  return (
    <fieldset>
      <legend>{legend}</legend>
      <div class={`choices choices-${name}`}>
        {choices.map(({ value, name: label, text, disabled }) => (
          <label key={value} class="choice">
            <input
              type="radio"
              name={name}
              value={value}
              data-testid={`calibrate-${name}-${value}`}
              checked={value === chosen}
              disabled={disabled}
              onChange={() => choose(value)}
            />
            <span>
              <strong>{label}</strong>
              {text && <small>{text}</small>}
            </span>
          </label>
        ))}
      </div>
    </fieldset>
  );
}
