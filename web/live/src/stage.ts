// The hand's place on the page: the drawing, which hand and from where, what the marks mean, and what the hand complains of.
import type { App } from './app';
import { known, kQualityWords, qualityShape } from './colours';
import { h, setAttribute, setText, show, title } from './dom';
import { wantFrame } from './frames';
import type { HandScene, View } from './hand';
import { fingerOf, type FingerName } from './mapping';
import type { Quality, Side, State } from './state';

const kQualities: Quality[] = ['good', 'fair', 'poor', 'none']; // from the best to the worst
const kTurn_rad = 0.15; // by an arrow key
const kTurn_radPerPx = 0.008;

export class Stage {
  readonly element: HTMLElement;
  private readonly place = h('div', { class: 'stage-canvas' });
  private readonly message = h('p', { class: 'stage-message' }, 'Drawing the hand …');
  private readonly bionicLabel = h('span', {}, 'Bionic hand');
  private readonly fault = h('p', { class: 'stage-fault', 'data-testid': 'hand-fault', hidden: true });
  private readonly sides: Toggles<Side>;
  private readonly ownLabel = h('span', {}, 'Your hand');
  private scene: HandScene | null = null;
  private loading = false;
  private chosen: Side | null = null; // by the switch, until the model says another
  private modelSide: Side | null = null;
  private drawnSide: Side | null = null;

  constructor(private readonly app: App) {
    this.sides = new Toggles<Side>('Which hand is drawn', 'side', ['left', 'right'], (side) => {
      this.chosen = side;
      this.chooseSide();
    });
    const views = new Toggles<View>('Seen from', 'view', ['palm', 'side', 'back'], (view) => this.scene?.setView(view));
    views.set('palm');
    this.element = h(
      'section',
      { class: 'stage', 'aria-label': 'Hand', 'data-testid': 'stage' },
      this.place,
      h('div', { class: 'stage-labels', 'aria-hidden': 'true' }, this.ownLabel, this.bionicLabel),
      this.message,
      this.fault,
      h('div', { class: 'stage-bar' }, this.sides.element, views.element),
      legend(),
    );
  }

  // After the first paint, so that three.js keeps nobody waiting for the sentence and the cards.
  async start(): Promise<void> {
    if (this.scene || this.loading) return;
    this.loading = true;
    try {
      const { HandScene } = await import('./hand');
      this.scene = new HandScene(this.place, new URL('hand/', document.baseURI).href, wantFrame);
      this.show(this.scene);
    } catch {
      setText(this.message, 'This browser draws no 3-D here. The cards show every angle.');
    }
    this.loading = false;
  }

  update(): void {
    const { state } = this.app.store;
    const side = state.model?.side ?? null;
    if (side !== this.modelSide) {
      this.modelSide = side;
      if (side) this.chosen = null;
    }
    this.chooseSide();
    const two = this.app.store.bionicPose() !== null;
    this.element.classList.toggle('two', two);
    show(this.bionicLabel, two);
    const still = state.fingers.length > 0 && state.fingers.every(({ angle_deg }) => angle_deg === null);
    setText(this.ownLabel, still ? 'Your hand, not calibrated: it stands still' : 'Your hand');
    setText(this.bionicLabel, `Bionic hand${kHandWords[state.hand?.status ?? ''] ?? ''}`);
    const faults = faultsOf(state);
    setText(this.fault, faults);
    show(this.fault, faults !== '');
    if (this.scene) setAttribute(this.scene.canvas, 'aria-label', this.inWords(state));
    this.pose();
  }

  draw(): void {
    this.pose();
    if (this.scene?.render()) show(this.message, false);
  }

  private show(scene: HandScene): void {
    setAttribute(scene.canvas, 'role', 'img');
    setAttribute(scene.canvas, 'tabindex', '0');
    setAttribute(scene.canvas, 'data-testid', 'hand-canvas');
    setAttribute(scene.canvas, 'aria-label', this.inWords(this.app.store.state));
    this.place.append(scene.canvas);
    makeTurnable(scene);
    this.chooseSide();
    this.pose();
  }

  private chooseSide(): void {
    const wanted = this.chosen ?? this.modelSide ?? 'right';
    this.sides.set(wanted);
    if (wanted === this.drawnSide || !this.scene) return;
    this.drawnSide = wanted;
    this.scene
      .setSide(wanted)
      .catch(() => setText(this.message, 'The drawn hand could not be loaded. Reload the page.'));
  }

  private pose(): void {
    if (!this.scene) return;
    const quality: Partial<Record<FingerName, Quality>> = {};
    for (const finger of this.app.store.state.fingers) {
      const at = fingerOf(finger.name);
      if (at) quality[at.finger] = worse(quality[at.finger], known(finger.quality));
    }
    this.scene.setPose(this.app.store.handPose(), quality);
    this.scene.setBionic(this.app.store.bionicPose());
  }

  private inWords(state: State): string {
    const angles = state.fingers.map((finger) => {
      const called_deg = Math.round(this.app.store.called_deg(finger, finger.angle_deg));
      const angle = Number.isNaN(called_deg) ? 'not known' : `${called_deg} degrees`;
      return `${finger.name} ${angle}`;
    });
    return `${title(this.drawnSide ?? 'right')} hand. ${angles.join(', ')}. Arrow keys turn it.`;
  }
}

// Buttons of which one is pressed.
class Toggles<T extends string> {
  readonly element: HTMLElement;

  constructor(name: string, test: string, values: readonly T[], pick: (value: T) => void) {
    const buttons = values.map((value) => {
      const press = (): void => {
        this.set(value);
        pick(value);
      };
      return h(
        'button',
        { type: 'button', 'data-value': value, 'data-testid': `${test}-${value}`, click: press },
        title(value),
      );
    });
    this.element = h('div', { class: 'segmented', role: 'group', 'aria-label': name }, ...buttons);
  }

  set(value: T): void {
    for (const button of this.element.children) {
      setAttribute(button, 'aria-pressed', String((button as HTMLElement).dataset['value'] === value));
    }
  }
}

function legend(): HTMLElement {
  const marks = kQualities.map((quality) => h('li', {}, qualityShape(quality), kQualityWords[quality]));
  const estimated = h('li', {}, h('span', { class: 'dashed-ring', 'aria-hidden': 'true' }), 'estimated');
  return h('ul', { class: 'legend', 'aria-label': 'Marks on the joints' }, ...marks, estimated);
}

const kHandWords: Record<string, string> = {
  simulated: ', simulated',
  gone: ', unplugged',
  waits: ', which waits for its glove',
};

function faultsOf(state: State): string {
  const faults = state.hand?.faults ?? [];
  return [...faults.map((text, i) => (text ? `${title(state.hand?.names[i] ?? '')}: ${text}` : '')), state.hand?.board]
    .filter(Boolean)
    .join(' ');
}

function worse(a: Quality | undefined, b: Quality): Quality {
  return a && kQualities.indexOf(a) > kQualities.indexOf(b) ? a : b;
}

// By dragging, and by arrow keys.
function makeTurnable(scene: HandScene): void {
  let last_px: number | null = null;
  scene.canvas.addEventListener('pointerdown', (event) => {
    last_px = event.clientX;
    scene.canvas.setPointerCapture(event.pointerId);
  });
  scene.canvas.addEventListener('pointermove', (event) => {
    if (last_px === null) return;
    scene.turn((last_px - event.clientX) * kTurn_radPerPx);
    last_px = event.clientX;
  });
  for (const end of ['pointerup', 'pointercancel']) {
    scene.canvas.addEventListener(end, () => {
      last_px = null;
    });
  }
  scene.canvas.addEventListener('keydown', (event) => {
    const turn = { ArrowLeft: kTurn_rad, ArrowRight: -kTurn_rad }[event.key];
    if (turn === undefined) return;
    event.preventDefault();
    scene.turn(turn);
  });
}
