// A control that asks the program for something: it waits while it waits, and what went wrong stands beside it.
import { h, setAttribute, setText, show } from './dom';

export type Do = (what: string, parts?: Record<string, unknown>) => Promise<string | null>;

// One line under a group of controls. Empty while all is well.
export function errorLine(testId: string): HTMLParagraphElement {
  return h('p', { class: 'error', role: 'alert', 'data-testid': testId, hidden: true });
}

export function say(line: HTMLElement, error: string | null): void {
  setText(line, error ?? '');
  show(line, error !== null);
}

export interface ButtonOptions {
  label: string;
  testId: string;
  kind?: 'primary' | 'quiet' | 'danger';
  error: HTMLElement;
  ask: () => Promise<string | null>;
}

export function button(options: ButtonOptions): HTMLButtonElement {
  const element: HTMLButtonElement = h(
    'button',
    { type: 'button', class: `button ${options.kind ?? ''}`, 'data-testid': options.testId },
    options.label,
  );
  element.addEventListener('click', async () => {
    if (element.dataset['busy'] === 'yes') return;
    element.dataset['busy'] = 'yes';
    element.setAttribute('aria-busy', 'true');
    say(options.error, null);
    const error = await options.ask();
    say(options.error, error);
    delete element.dataset['busy'];
    element.removeAttribute('aria-busy');
  });
  return element;
}

// On or off, as `set` says.
export function toggle(label: string, testId: string, turn: (on: boolean) => void) {
  const element = h(
    'button',
    { type: 'button', role: 'switch', class: 'switch', 'data-testid': testId },
    h('span', { class: 'switch-knob', 'aria-hidden': 'true' }),
    label,
  );
  const set = (on: boolean): void => setAttribute(element, 'aria-checked', String(on));
  element.addEventListener('click', () => turn(element.getAttribute('aria-checked') !== 'true'));
  set(false);
  return { element, set };
}
