// Scopes: for each finger the reading and, beside it, the angle that the compensator makes of it, over the last minute.
import { button, errorLine } from './action';
import type { App } from './app';
import { fingerColour } from './colours';
import { degrees, h, keyed, number, setAttribute, setText, show, title } from './dom';
import { axis, css, loadPlots, onScheme, type Plot, type Plots } from './plots';
import type { Finger } from './state';
import { TimeWindow } from './time_window';

const kWindows_s = [5, 15, 60];
const kHeight_px = 132;
const kNarrowest_px = 160;
const kLeastBetween_ms = 30; // plots need no more than 30 pictures a second
const kBeyond_s = 0.5; // rows beyond the edges, so that lines reach them

interface Pane {
  channel: number;
  kind: 'raw' | 'angle';
  place: HTMLElement;
  value: HTMLElement;
  plot: Plot;
}

export class Scopes {
  readonly element: HTMLElement;
  private readonly rows = h('div', { class: 'scopes' });
  private readonly chips = h('div', { class: 'chips', role: 'group', 'aria-label': 'Fingers in the scopes' });
  private readonly empty = h('p', { class: 'empty' }, 'Nothing has been sent yet.');
  private readonly note = h('input', {
    type: 'text',
    id: 'marker-text',
    placeholder: 'what happened',
    maxlength: 80,
    'data-testid': 'marker-text',
  });
  private readonly hold = h(
    'button',
    { type: 'button', class: 'button', 'data-testid': 'scope-pause', 'aria-pressed': 'false' },
    'Pause',
  );
  private readonly widths: HTMLButtonElement[];
  private readonly window = new TimeWindow();
  private readonly hidden = new Set<string>();
  private panes: Pane[] = [];
  private built = '';
  private making = false;
  private visible = false;
  private last_ms = 0;

  constructor(private readonly app: App) {
    this.hold.addEventListener('click', () => (this.window.paused ? this.window.run() : this.window.pause()));
    this.hold.addEventListener('click', () => this.changed());
    this.widths = kWindows_s.map((span_s) => {
      const choose = (): void => {
        this.window.run(span_s);
        this.changed();
      };
      return h('button', { type: 'button', 'data-testid': `window-${span_s}`, click: choose }, `${span_s} s`);
    });
    const error = errorLine('marker-error');
    this.element = h(
      'section',
      { class: 'panel', 'aria-labelledby': 'scopes-title', 'data-testid': 'scopes' },
      h('div', { class: 'panel-head' }, h('h2', { id: 'scopes-title' }, 'Scopes'), this.chips),
      this.toolbar(error),
      error,
      h('p', { class: 'muted hint' }, 'Draw across a scope to zoom in. Raw on the left, compensated on the right.'),
      this.rows,
      this.empty,
    );
    this.changed();
    new ResizeObserver(() => this.fit()).observe(this.rows);
    onScheme(() => void this.build());
  }

  shown(yes: boolean): void {
    this.visible = yes;
    this.redraw();
  }

  update(): void {
    const { fingers } = this.app.store.state;
    show(this.empty, fingers.length === 0);
    keyed(
      this.chips,
      fingers,
      (finger) => finger.name,
      (finger) => this.chip(finger),
    );
    const now = fingers.map((finger) => `${finger.name} ${finger.unit}`).join();
    if (!this.visible || now === this.built) return;
    this.built = now;
    void this.build();
  }

  draw(now_ms: number): void {
    if (this.window.paused || now_ms - this.last_ms < kLeastBetween_ms) return;
    this.last_ms = now_ms;
    this.redraw();
  }

  private toolbar(error: HTMLElement): HTMLElement {
    const oldest = (): number => this.app.store.glove.angle.oldest_s;
    const tool = (sign: string, name: string, test: string, act: () => void): HTMLElement => {
      const click = (): void => {
        act();
        this.changed();
      };
      return h(
        'button',
        { type: 'button', class: 'button small', 'aria-label': name, title: name, 'data-testid': test, click },
        sign,
      );
    };
    return h(
      'div',
      { class: 'row toolbar' },
      this.hold,
      h('div', { class: 'segmented', role: 'group', 'aria-label': 'Width of the scopes' }, ...this.widths),
      h(
        'div',
        { class: 'row tools' },
        tool('−', 'Zoom out', 'scope-out', () => this.window.zoom(1.6, oldest())),
        tool('+', 'Zoom in', 'scope-in', () => this.window.zoom(1 / 1.6, oldest())),
        tool('←', 'Earlier', 'scope-earlier', () => this.window.pan(-0.25, oldest())),
        tool('→', 'Later', 'scope-later', () => this.window.pan(0.25, oldest())),
      ),
      h(
        'span',
        { class: 'marker-field' },
        h('label', { for: 'marker-text', class: 'sr' }, 'Text of the marker'),
        this.note,
        button({ label: 'Set marker', testId: 'marker', error, ask: () => this.setMarker() }),
      ),
    );
  }

  private chip({ name }: Finger): HTMLElement {
    const chip = h(
      'button',
      { type: 'button', class: 'chip', 'aria-pressed': 'true', 'data-testid': `scope-${name}` },
      h('span', { class: 'swatch', 'aria-hidden': 'true' }),
      title(name),
    );
    chip.addEventListener('click', () => {
      if (!this.hidden.delete(name)) this.hidden.add(name);
      setAttribute(chip, 'aria-pressed', String(!this.hidden.has(name)));
      void this.build();
    });
    chip.style.setProperty('--finger', fingerColour(name));
    return chip;
  }

  private async setMarker(): Promise<string | null> {
    const wrong = await this.app.do('marker', { text: this.note.value.trim() || 'marker' });
    if (wrong === null) this.note.value = '';
    return wrong;
  }

  // The window, by whatever hand.
  private changed(): void {
    const { paused, span_s } = this.window;
    setText(this.hold, paused ? 'Go on' : 'Pause');
    setAttribute(this.hold, 'aria-pressed', String(paused));
    this.widths.forEach((width, i) => setAttribute(width, 'aria-pressed', String(!paused && kWindows_s[i] === span_s)));
    this.redraw();
  }

  private async build(): Promise<void> {
    if (this.making) return;
    this.making = true;
    const plots = await loadPlots();
    this.making = false;
    for (const pane of this.panes) pane.plot.destroy();
    this.panes = [];
    this.rows.replaceChildren();
    this.app.store.state.fingers.forEach((finger, channel) => {
      if (this.hidden.has(finger.name)) return;
      for (const kind of ['raw', 'angle'] as const) this.panes.push(this.pane(plots, finger, channel, kind));
    });
    this.redraw();
  }

  private pane(plots: Plots, { name, unit }: Finger, channel: number, kind: Pane['kind']): Pane {
    const value = h('span', { class: 'scope-value', 'data-testid': `scope-${kind}-${name}` });
    const label = `${title(name)}, ${kind === 'raw' ? 'reading' : 'angle'} over time`;
    const place = h('div', { class: 'plot', role: 'img', 'aria-label': label });
    const head = h(
      'p',
      { class: 'scope-head' },
      h('span', { class: 'swatch', 'aria-hidden': 'true' }),
      h('strong', {}, title(name)),
      kind === 'raw' ? `raw, ${unit ?? 'reading'}` : 'compensated, degrees',
      value,
    );
    const box = h('div', { class: 'scope' }, head, place);
    box.style.setProperty('--finger', fingerColour(name));
    this.rows.append(box);
    return { channel, kind, place, value, plot: this.plot(plots, place, fingerColour(name)) };
  }

  private plot(plots: Plots, place: HTMLElement, colour: string): Plot {
    const { window } = this;
    return new plots(
      {
        width: Math.max(kNarrowest_px, place.clientWidth),
        height: kHeight_px,
        legend: { show: false },
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
        hooks: { draw: [(plot) => this.drawMarkers(plot)], setSelect: [(plot) => this.select(plot)] },
      },
      [[], []],
      place,
    );
  }

  private select(plot: Plot): void {
    const { left, width } = plot.select;
    if (width < 4) return; // a click
    const from_s = plot.posToVal(left, 'x');
    const to_s = plot.posToVal(left + width, 'x');
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.window.look(from_s, to_s, this.app.store.glove.angle.oldest_s);
    this.changed();
  }

  private drawMarkers(plot: Plot): void {
    const { ctx: c, bbox } = plot;
    const ratio = window.devicePixelRatio;
    c.save();
    c.strokeStyle = c.fillStyle = css('--ink');
    c.lineWidth = ratio;
    c.setLineDash([3 * ratio, 3 * ratio]);
    c.font = `${11 * ratio}px ${css('--font')}`;
    c.textBaseline = 'top';
    c.textAlign = 'left';
    for (const { host_s, text } of this.app.store.markers) {
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

  private redraw(): void {
    const { glove, state } = this.app.store;
    if (!this.visible || glove.angle.rows === 0) return;
    this.window.advance(glove.angle.newest_s);
    const { from_s, to_s } = this.window;
    for (const { channel, kind, plot, value } of this.panes) {
      const ring = kind === 'raw' ? glove.first : glove.angle;
      if (channel >= ring.channels) continue;
      const { t_s, value: values } = ring.slice(channel, from_s - kBeyond_s, to_s + kBeyond_s, plot.width);
      const called = (v: number): number => this.app.store.called_deg(state.fingers[channel], v);
      plot.setData([t_s, kind === 'raw' ? values : values.map((v) => (v === null ? null : called(v)))]);
      const latest = ring.last(channel);
      if (!this.window.paused) setText(value, kind === 'raw' ? number(latest) : degrees(called(latest)));
    }
  }

  private fit(): void {
    for (const { plot, place } of this.panes) {
      const width = Math.max(kNarrowest_px, place.clientWidth);
      if (width !== plot.width) plot.setSize({ width, height: kHeight_px });
    }
  }
}
