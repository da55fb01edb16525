// Small helpers to build and to change the page. Changes that change nothing touch nothing: state comes five times a
// second, and a screen reader should hear only what is new.

import type { Job } from './state';

type Child = Node | string | null | undefined | false;
type Attributes = Record<string, string | number | boolean | null | undefined | ((event: Event) => void)>;

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(name, value);
    else if (value === true) element.setAttribute(name, '');
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, String(value));
  }
  append(element, children);
  return element;
}

export function append(element: Element, children: Child[]): void {
  for (const child of children) {
    if (child !== null && child !== undefined && child !== false) element.append(child);
  }
}

const kSvg = 'http://www.w3.org/2000/svg';
export function svg(tag: string, attributes: Record<string, string | number> = {}, ...children: Node[]): SVGElement {
  const element = document.createElementNS(kSvg, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

export function setText(node: Node, text: string): void {
  if (node.textContent !== text) node.textContent = text;
}

export function setAttribute(element: Element, name: string, value: string | null): void {
  if (value === null) element.removeAttribute(name);
  else if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

export function show(element: HTMLElement, yes: boolean): void {
  if (element.hidden === yes) element.hidden = !yes;
}

export function enable(control: HTMLButtonElement | HTMLInputElement | HTMLSelectElement, yes: boolean): void {
  if (control.dataset['busy'] === 'yes') return;
  if (control.disabled === yes) control.disabled = !yes;
}

export function setProperty(element: HTMLElement | SVGElement, name: string, value: string): void {
  if (element.style.getPropertyValue(name) !== value) element.style.setProperty(name, value);
}

// The children of a list by key: made when new, in the list's order, removed when gone.
export function keyed<T, E extends Element>(
  parent: Element,
  items: readonly T[],
  key: (item: T) => string,
  make: (item: T) => E,
  update: (element: E, item: T) => void = () => {},
): void {
  const old = new Map<string, E>();
  for (const child of Array.from(parent.children)) old.set((child as HTMLElement).dataset['key'] ?? '', child as E);
  let at: Element | null = parent.firstElementChild;
  for (const item of items) {
    const name = key(item);
    let element = old.get(name);
    old.delete(name);
    if (!element) {
      element = make(item);
      (element as unknown as HTMLElement).dataset['key'] = name;
    }
    if (element === at) at = at.nextElementSibling;
    else parent.insertBefore(element, at);
    update(element, item);
  }
  for (const gone of old.values()) gone.remove();
}

// The options of a select, kept while they are the same, so that an open list is not closed five times a second.
// `first`: chosen when nothing has been.
export function setOptions(
  select: HTMLSelectElement,
  options: readonly { value: string; text: string }[],
  first?: string,
): void {
  const now = JSON.stringify(options);
  if (select.dataset['options'] === now) return;
  const chosen =
    select.dataset['options'] === undefined || select.value === '' ? (first ?? select.value) : select.value;
  select.dataset['options'] = now;
  select.replaceChildren(...options.map((o) => h('option', { value: o.value }, o.text)));
  if (options.some((o) => o.value === chosen)) select.value = chosen;
}

export function degrees(value: number | null | undefined, digits = 0): string {
  return value === null || value === undefined || !Number.isFinite(value) ? '–' : `${value.toFixed(digits)}°`;
}

export function number(value: number | null | undefined, digits = 0): string {
  return value === null || value === undefined || !Number.isFinite(value) ? '–' : value.toFixed(digits);
}

export function percent(share: number | null | undefined): string {
  return share === null || share === undefined || !Number.isFinite(share) ? '–' : `${Math.round(share * 100)} %`;
}

// How far a job is.
export function progressOf({ stage, name, share, left_s }: Job): string {
  const parts = [stage && stage !== name ? title(stage) : '', share === null ? '' : percent(share)];
  return [...parts, left_s === null ? '' : `${number(left_s)} s left`].filter(Boolean).join(', ');
}

export function time(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return '–';
  const whole = Math.max(0, Math.floor(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}`;
}

export function title(name: string): string {
  return (name.charAt(0).toUpperCase() + name.slice(1)).replaceAll('_', ' ');
}

// A table with its caption, and a column for each name; an empty name is a column without a heading.
export function tableOf(testId: string, caption: string, columns: readonly string[]) {
  const body = h('tbody', {});
  const head = columns.map((name) => (name === '' ? h('td', {}) : h('th', { scope: 'col' }, name)));
  const table = h(
    'table',
    { class: 'table', 'data-testid': testId },
    h('caption', {}, caption),
    h('thead', {}, h('tr', {}, ...head)),
    body,
  );
  return { table, body };
}

// A part of a place, called by its heading.
export function panel(id: string, name: string, ...children: Child[]): HTMLElement {
  return h(
    'section',
    { class: `panel part-${id}`, 'aria-labelledby': `${id}-title`, 'data-testid': `panel-${id}` },
    h('h2', { id: `${id}-title` }, name),
    ...children,
  );
}
