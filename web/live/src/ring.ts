// The last minute of some channels. Rows come in time's order; what is older than the ring is long is overwritten.
//
// A ring holds at most `capacity` rows: of rows that come faster than capacity / length_s, the later of two near ones
// takes the place of the earlier, so that a minute stays a minute at any rate and memory stays flat.

const kPause_s = 2; // longer without a row is a gap

export class Ring {
  private readonly spacing_s: number;
  private readonly times_: Float64Array;
  private readonly values_: Float32Array[];
  private from_ = 0;
  private rows_ = 0;
  private kept_s_ = -Infinity; // time of the last row that got a place of its own

  constructor(
    readonly channels: number,
    readonly length_s = 60,
    readonly capacity = 18000,
  ) {
    this.spacing_s = length_s / capacity;
    this.times_ = new Float64Array(capacity);
    this.values_ = Array.from({ length: channels }, () => new Float32Array(capacity));
  }

  get rows(): number {
    return this.rows_;
  }

  get newest_s(): number {
    return this.rows_ === 0 ? NaN : this.times_[this.at(this.rows_ - 1)]!;
  }

  get oldest_s(): number {
    return this.rows_ === 0 ? NaN : this.times_[this.from_]!;
  }

  clear(): void {
    this.from_ = 0;
    this.rows_ = 0;
    this.kept_s_ = -Infinity;
  }

  // A clock that goes back is another clock: what was before goes.
  push(t_s: number, values: Float32Array, offset: number): void {
    if (t_s < this.newest_s) this.clear();
    if (t_s - this.newest_s > kPause_s) this.push(this.newest_s + kPause_s / 2, new Float32Array(this.channels).fill(NaN), 0);
    // A hair of tolerance, so that rows that come at just this rate are not halved by rounding.
    const near = this.rows_ > 0 && t_s - this.kept_s_ < this.spacing_s * 0.999;
    if (!near) {
      this.kept_s_ = t_s;
      if (this.rows_ === this.capacity) this.from_ = (this.from_ + 1) % this.capacity;
      else ++this.rows_;
    }
    const at = this.at(this.rows_ - 1);
    this.times_[at] = t_s;
    for (let c = 0; c < this.channels; ++c) this.values_[c]![at] = values[offset + c]!;
    while (this.rows_ > 1 && this.times_[this.from_]! < t_s - this.length_s) {
      this.from_ = (this.from_ + 1) % this.capacity;
      --this.rows_;
    }
  }

  last(channel: number): number {
    return this.rows_ === 0 ? NaN : this.values_[channel]![this.at(this.rows_ - 1)]!;
  }

  // Rows between two times for a plot that is `columns` wide: of each column at most the least and the greatest, in
  // time's order, so that no spike is lost. A gap (NaN) stays a gap.
  slice(channel: number, from_s: number, to_s: number, columns: number): { t_s: number[]; value: (number | null)[] } {
    const t_s: number[] = [];
    const value: (number | null)[] = [];
    const first = this.find(from_s);
    const end = this.find(to_s + 1e-9);
    const stride = Math.max(1, Math.ceil((end - first) / Math.max(1, columns)));
    const values = this.values_[channel]!;
    for (let row = first; row < end; row += stride) {
      const stop = Math.min(end, row + stride);
      let least = -1;
      let most = -1;
      let gap = -1;
      for (let r = row; r < stop; ++r) {
        const at = this.at(r);
        const v = values[at]!;
        if (Number.isNaN(v)) gap = r;
        else {
          if (least < 0 || v < values[this.at(least)]!) least = r;
          if (most < 0 || v > values[this.at(most)]!) most = r;
        }
      }
      const wanted = [...new Set([least, most, gap])].filter((r) => r >= 0).sort((a, b) => a - b);
      for (const r of wanted) {
        const v = values[this.at(r)]!;
        t_s.push(this.times_[this.at(r)]!);
        value.push(Number.isNaN(v) ? null : v);
      }
    }
    return { t_s, value };
  }

  // The first row at or after a time.
  private find(t_s: number): number {
    let low = 0;
    let high = this.rows_;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times_[this.at(middle)]! < t_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  private at(row: number): number {
    return (this.from_ + row) % this.capacity;
  }
}
