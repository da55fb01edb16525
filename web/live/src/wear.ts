// Wear: the hand, what to do next, a card for each finger, and what one does while wearing.
import type { App, Place } from './app';
import { createCards } from './cards';
import { h } from './dom';
import { createAnew, createGlove, createModel, createRecord } from './panels';
import { Stage } from './stage';

export function createWear(app: App): Place {
  const stage = new Stage(app);
  const cards = createCards(app);
  const panels = [createRecord(app), createGlove(app), createModel(app), createAnew(app)];
  const element = h(
    'div',
    { class: 'wear' },
    h('div', { class: 'wear-main' }, stage.element, cards.element),
    h('div', { class: 'wear-side' }, ...panels.map((panel) => panel.element)),
  );
  return {
    element,
    update() {
      stage.update();
      cards.update();
      for (const panel of panels) panel.update();
    },
    draw() {
      stage.draw();
      cards.draw();
    },
    shown(yes) {
      if (yes) void stage.start();
    },
  };
}
