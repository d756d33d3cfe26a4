// The range of an axis and its map to pixels.

export class Scale {
  constructor(
    public low: number,
    public high: number,
    readonly log: boolean,
  ) {}

  /** @returns the share of the axis, 0 at `low` and 1 at `high`. */
  share(value: number): number {
    return (this.warp(value) - this.warp(this.low)) / (this.warp(this.high) - this.warp(this.low));
  }
  value(share: number): number {
    return this.unwarp(this.warp(this.low) + share * (this.warp(this.high) - this.warp(this.low)));
  }
  zoom(factor: number): void {
    this.show(0.5 - 0.5 * factor, 0.5 + 0.5 * factor);
  }
  pan(share: number): void {
    this.show(share, 1 + share);
  }
  /** Shows the range between two shares of the present one. */
  show(low: number, high: number): void {
    const shown = [this.value(low), this.value(high)];
    if (!shown.every(Number.isFinite) || !(shown[0] < shown[1])) return;
    [this.low, this.high] = shown;
  }

  private warp(value: number): number {
    return this.log ? Math.log10(value) : value;
  }
  private unwarp(value: number): number {
    return this.log ? 10 ** value : value;
  }
}

/** A range that contains all finite values (above 0 on a logarithmic axis), with a margin. */
export function scale_of(lists: Float32Array[], log: boolean, margin = 0.04): Scale {
  let low = Infinity;
  let high = -Infinity;
  for (const list of lists)
    for (const value of list) {
      if (!Number.isFinite(value) || (log && value <= 0)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  if (low > high) return new Scale(log ? 0.1 : 0, 1, log);
  if (low === high) return log ? new Scale(low / 2, high * 2, log) : new Scale(low - 1, high + 1, log);
  const scale = new Scale(low, high, log);
  scale.show(-margin, 1 + margin);
  return scale;
}
