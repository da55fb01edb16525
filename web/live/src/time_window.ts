// Which stretch of the last minute is looked at: the newest seconds while it runs, any stretch while it stands.

const kLongest_s = 60;
const kShortest_s = 0.1;

export class TimeWindow {
  span_s = 15; // while it runs
  paused = false;
  now_s = 0; // what an axis counts from: the newest row, or the newest when it was stopped
  private stoodFrom_s = 0;
  private stoodTo_s = 0;

  get from_s(): number {
    return this.paused ? this.stoodFrom_s : this.now_s - this.span_s;
  }

  get to_s(): number {
    return this.paused ? this.stoodTo_s : this.now_s;
  }

  run(span_s = this.span_s): void {
    this.span_s = span_s;
    this.paused = false;
  }

  // A row has come.
  advance(newest_s: number): void {
    if (!this.paused) this.now_s = newest_s;
  }

  pause(): void {
    if (this.paused) return;
    this.stoodTo_s = this.now_s;
    this.stoodFrom_s = this.now_s - this.span_s;
    this.paused = true;
  }

  // That stretch, as far as there is something to see: from the oldest row to the newest.
  look(from_s: number, to_s: number, oldest_s: number): void {
    this.pause();
    const width = Math.min(kLongest_s, Math.max(kShortest_s, to_s - from_s));
    const latest = this.now_s - width;
    this.stoodFrom_s = Math.max(Math.min(from_s, latest), Math.min(oldest_s, latest));
    this.stoodTo_s = this.stoodFrom_s + width;
  }

  zoom(factor: number, oldest_s: number): void {
    const middle = (this.from_s + this.to_s) / 2;
    const half = ((this.to_s - this.from_s) / 2) * factor;
    this.look(middle - half, middle + half, oldest_s);
  }

  // By a share of what is seen.
  pan(share: number, oldest_s: number): void {
    const step = (this.to_s - this.from_s) * share;
    this.look(this.from_s + step, this.to_s + step, oldest_s);
  }

  // Ticks at whole steps before now, so that they read 0, -5, -10 and do not jitter while it runs.
  ticks(from_s: number, to_s: number, step_s: number): number[] {
    const ticks: number[] = [];
    for (let k = Math.ceil((this.now_s - to_s) / step_s); this.now_s - k * step_s >= from_s; ++k) {
      ticks.push(this.now_s - k * step_s);
    }
    return ticks.reverse();
  }

  label(t_s: number): string {
    const before = t_s - this.now_s;
    const whole = Math.round(before);
    const text = Math.abs(before - whole) < 0.005 ? String(whole) : before.toFixed(2).replace(/0$/, '');
    return `${text === '-0' ? '0' : text.replace('-', '−')} s`;
  }
}
