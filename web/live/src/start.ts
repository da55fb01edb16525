// Before a calibration: who, which hand, and what measures the true angle.
import { button, errorLine, say } from './action';
import type { App } from './app';
import { h, keyed, setOptions, show, title } from './dom';
import { kHasMarkerless } from './markerless';
import { createMarks } from './marks';
import type { Reference, State } from './state';

const kReferences: { value: Reference; name: string; text: string }[] = [
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
      : 'This page was built without its model. script/bootstrap and script/build say why.',
  },
  {
    value: 'drawn',
    name: 'The drawn hand',
    text: 'With the simulated glove: its own hand, drawn, is what the camera sees.',
  },
];

const kSides = [
  { value: 'left', name: 'Left', text: '' },
  { value: 'right', name: 'Right', text: '' },
];
const kFirstJoints = 'paper_hand'; // all five fingers

export function createStart(app: App) {
  const error = errorLine('calibrate-start-error');
  const people = h('datalist', { id: 'people' });
  const person = h('input', {
    id: 'person',
    type: 'text',
    list: 'people',
    autocomplete: 'off',
    spellcheck: 'false',
    'data-testid': 'calibrate-person',
    placeholder: 'anna',
    input: () => say(error, null),
  });
  const sides = radios('side', kSides);
  sides.set('right'); // as `flexor deploy`
  const references = radios('reference', kReferences);
  if (!kHasMarkerless) references.disable('markerless');
  const joints = h('select', { id: 'joints', 'data-testid': 'calibrate-joints' });
  const marks = createMarks('marks-chosen');
  const label = h('label', { for: 'joints' }, 'Where the marks are');
  const jointsField = h('div', { class: 'field' }, label, joints, marks.element);
  joints.addEventListener('change', () => marks.set(joints.value));
  const ask = (): Promise<string | null> => {
    const name = person.value.trim();
    if (name === '') {
      person.focus();
      return Promise.resolve('Write a name first: calibrations are kept for each person.');
    }
    const reference = references.value() as Reference;
    const marks = reference === 'marks' ? { joints: joints.value } : {};
    return app.do('calibrate.start', { person: name, side: sides.value(), reference, ...marks });
  };
  const element = h(
    'section',
    { class: 'panel start', 'aria-labelledby': 'start-title' },
    h('h2', { id: 'start-title', class: 'big' }, 'Teach the glove your hand'),
    h(
      'p',
      { class: 'muted' },
      'Three minutes with a camera, one without. You can leave at any step and come back: the steps stay where they were.',
    ),
    h('div', { class: 'field' }, h('label', { for: 'person' }, 'Name'), person, people),
    h('fieldset', {}, h('legend', {}, 'Hand'), sides.element),
    h('fieldset', {}, h('legend', {}, 'What measures the true angle'), references.element),
    jointsField,
    h(
      'div',
      { class: 'row' },
      button({ label: 'Start calibration', testId: 'calibrate-start', kind: 'primary', error, ask }),
    ),
    error,
  );
  references.element.addEventListener('change', () => show(jointsField, references.value() === 'marks'));
  return {
    element,
    update() {
      const { state } = app.store;
      keyed(
        people,
        peopleOf(state),
        (name) => name,
        (name) => h('option', { value: name }),
      );
      setOptions(
        joints,
        state.joint_files.map((name) => ({ value: name, text: title(name) })),
        kFirstJoints,
      );
      marks.set(joints.value);
      if (state.model?.side && !sides.touched()) sides.set(state.model.side);
      const simulated = state.twin !== null;
      references.offer('drawn', simulated);
      if (!references.touched()) references.set(simulated ? 'drawn' : 'marks');
      show(jointsField, references.value() === 'marks');
    },
  };
}

function peopleOf(state: State): string[] {
  return [...new Set(state.models.map((model) => model.person).filter((person): person is string => !!person))];
}

function radios(name: string, options: { value: string; name: string; text: string }[]) {
  let changed = false;
  const inputs = options.map((o) =>
    h('input', { type: 'radio', name, value: o.value, 'data-testid': `calibrate-${name}-${o.value}` }),
  );
  inputs[0]!.checked = true;
  const labels = options.map((o, i) =>
    h(
      'label',
      { class: 'choice' },
      inputs[i]!,
      h('span', {}, h('strong', {}, o.name), o.text !== '' && h('small', {}, o.text)),
    ),
  );
  const element = h('div', { class: `choices choices-${name}` }, ...labels);
  element.addEventListener('change', () => {
    changed = true;
  });
  return {
    element,
    touched: () => changed,
    value: () => inputs.find((input) => input.checked)!.value,
    set(value: string) {
      for (const input of inputs) if (input.value === value) input.checked = true;
    },
    disable(value: string) {
      for (const input of inputs) if (input.value === value) input.disabled = true;
    },
    offer(value: string, yes: boolean) {
      const at = options.findIndex((o) => o.value === value);
      show(labels[at]!, yes);
      if (!yes && inputs[at]!.checked) inputs[0]!.checked = true;
    },
  };
}
