import { slice } from "./document";
import type { Report, TimeFigure, TimeSeries } from "./document";

/** The points of all series over a range of time. NaN: a gap. */
export interface Samples {
  time_s: Float64Array;
  values: Float32Array[];
  /** Whether these are all samples, not minima and maxima of several. */
  complete: boolean;
}

/** Where a time figure takes its samples from: a report, or a connection to a running joint. */
export interface SampleSource {
  readonly begin_s: number;
  readonly end_s: number;
  range(begin_s: number, end_s: number, max_points: number): Samples;
}

/** Minima and maxima of ever longer buckets of one series. */
function pyramid_of(overview: Float32Array): Float32Array[] {
  const levels = [overview];
  while (levels[levels.length - 1].length > 64) levels.push(halved(levels[levels.length - 1]));
  return levels;
}

/** Of each two neighbouring buckets one: the extremes of both, in the order of their time. */
export function halved(fine: Float32Array): Float32Array {
  const buckets = Math.ceil(fine.length / 4);
  const coarse = new Float32Array(2 * buckets).fill(NaN);
  for (let bucket = 0; bucket < buckets; ++bucket) {
    let lowest = -1;
    let highest = -1;
    const end = Math.min(4 * bucket + 4, fine.length);
    for (let i = 4 * bucket; i < end; ++i) {
      if (Number.isNaN(fine[i])) continue;
      if (lowest < 0 || fine[i] < fine[lowest]) lowest = i;
      if (highest < 0 || fine[i] > fine[highest]) highest = i;
    }
    if (lowest < 0) continue;
    coarse[2 * bucket] = fine[Math.min(lowest, highest)];
    coarse[2 * bucket + 1] = fine[Math.max(lowest, highest)];
  }
  return coarse;
}

/** The series of a report's time figure. */
export class StoredSamples implements SampleSource {
  readonly begin_s: number;
  readonly end_s: number;
  private readonly levels: Float32Array[][];
  private readonly details: Float32Array[];

  constructor(report: Report, private readonly figure: TimeFigure, series: TimeSeries[]) {
    this.begin_s = figure.start_s;
    this.end_s = figure.start_s + Math.max(figure.samples - 1, 1) / figure.rate_Hz;
    this.levels = series.map((one) => pyramid_of(slice(report, one.overview)));
    this.details = series.map((one) => slice(report, one.detail));
  }

  range(begin_s: number, end_s: number, max_points: number): Samples {
    return this.window_at(begin_s, end_s, max_points) ?? this.overview(begin_s, end_s, max_points);
  }

  /** All samples of the range, if one window contains it and they are few enough to be drawn. */
  private window_at(begin_s: number, end_s: number, max_points: number): Samples | null {
    const { figure } = this;
    const first = Math.max(Math.floor((begin_s - figure.start_s) * figure.rate_Hz), 0);
    const last = Math.min(Math.ceil((end_s - figure.start_s) * figure.rate_Hz), figure.samples - 1);
    if (last - first > 2 * max_points) return null;
    let offset = 0;
    for (const { begin, end } of figure.windows) {
      if (first >= begin - 1 && last <= end) {
        const [from, to] = [Math.max(first, begin), Math.min(last + 1, end)];
        return {
          time_s: Float64Array.from({ length: to - from }, (_, i) => this.time_at(from + i)),
          values: this.details.map((detail) => detail.subarray(offset + from - begin, offset + to - begin)),
          complete: true,
        };
      }
      offset += end - begin;
    }
    return null;
  }

  private overview(begin_s: number, end_s: number, max_points: number): Samples {
    const { figure } = this;
    const half_samples = figure.bucket / 2;
    const points = ((end_s - begin_s) * figure.rate_Hz) / half_samples;
    const deepest = this.levels.length === 0 ? 0 : this.levels[0].length - 1;
    const level = Math.min(Math.max(Math.ceil(Math.log2(points / max_points)), 0), deepest);
    const step = half_samples * 2 ** level;
    const index_at = (time_s: number) => ((time_s - figure.start_s) * figure.rate_Hz) / step;
    const length = this.levels.length === 0 ? 0 : this.levels[0][level].length;
    // One point beyond each side, so that the lines reach the border.
    const begin = Math.max(Math.floor(index_at(begin_s)) - 1, 0);
    const end = Math.min(Math.ceil(index_at(end_s)) + 2, length);
    return {
      time_s: Float64Array.from({ length: Math.max(end - begin, 0) }, (_, i) =>
        this.time_at(Math.min((begin + i + 0.5) * step - 0.5, figure.samples - 1)),
      ),
      values: this.levels.map((levels) => levels[level].subarray(begin, end)),
      complete: false,
    };
  }

  private time_at(sample: number): number {
    return this.figure.start_s + sample / this.figure.rate_Hz;
  }
}
