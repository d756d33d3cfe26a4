// The last samples of a joint that is running, and minima and maxima of them for drawing.
import type { SampleSource, Samples } from "./sample_source";

/** Samples in the buckets whose extremes are kept. */
const kBuckets = [8, 32, 128];

interface Channel {
  values: Float32Array;
  /** For each size of bucket. */
  lowest: Float32Array[];
  highest: Float32Array[];
}

/** Some channels of one joint, in a ring of fixed length. Samples are numbered from the start of the program. */
export class LiveSamples {
  private readonly channels = new Map<string, Channel>();
  private readonly capacity: number;
  /** Number of the sample after the last one; 0: there are none. */
  private end = 0;

  /** @param longest_s at least this much is kept */
  constructor(
    names: string[],
    readonly rate_Hz: number,
    longest_s: number,
  ) {
    const coarsest = kBuckets[kBuckets.length - 1];
    this.capacity = coarsest * Math.ceil((longest_s * rate_Hz) / coarsest + 1);
    const empty = (length: number) => new Float32Array(length).fill(NaN);
    for (const name of names)
      this.channels.set(name, {
        values: empty(this.capacity),
        lowest: kBuckets.map((size) => empty(this.capacity / size)),
        highest: kBuckets.map((size) => empty(this.capacity / size)),
      });
  }

  has(name: string): boolean {
    return this.channels.has(name);
  }
  get begin_s(): number {
    return Math.max(this.end - this.capacity, 0) / this.rate_Hz;
  }
  get end_s(): number {
    return this.end / this.rate_Hz;
  }

  /** Samples from number `first` on; those between the last one and these are gaps. Older ones than the ring has are left
   * out. @param values one channel after the other, in the order of the names */
  add(first: number, count: number, values: Float32Array): void {
    const begin = this.end === 0 ? first : Math.min(this.end, first);
    const end = first + count;
    const from = Math.max(begin, end - this.capacity, 0);
    let at = 0;
    for (const channel of this.channels.values()) {
      for (let i = from; i < end; ++i)
        channel.values[i % this.capacity] = i < first ? NaN : values[at + i - first];
      this.condense(channel, from, end);
      at += count;
    }
    this.end = Math.max(this.end, end);
  }

  /** The extremes of the buckets that contain samples of this range. */
  private condense(channel: Channel, begin: number, end: number): void {
    kBuckets.forEach((size, level) => {
      for (let bucket = Math.floor(begin / size); bucket * size < end; ++bucket) {
        let lowest = NaN;
        let highest = NaN;
        // What follows the end is from the last turn of the ring.
        for (let i = bucket * size; i < Math.min((bucket + 1) * size, end); ++i) {
          const value = channel.values[i % this.capacity];
          if (!(value >= lowest)) lowest = Number.isNaN(value) ? lowest : value;
          if (!(value <= highest)) highest = Number.isNaN(value) ? highest : value;
        }
        const place = bucket % (this.capacity / size);
        channel.lowest[level][place] = lowest;
        channel.highest[level][place] = highest;
      }
    });
  }

  /** Samples of these channels. @returns all of the range, or extremes of buckets if they are more than twice `max_points` */
  range(names: string[], begin_s: number, end_s: number, max_points: number): Samples {
    const first = Math.max(Math.ceil(begin_s * this.rate_Hz), this.end - this.capacity, 0);
    const end = Math.min(Math.floor(end_s * this.rate_Hz) + 1, this.end);
    const count = Math.max(end - first, 0);
    if (count > 2 * max_points) {
      const level = kBuckets.findIndex((size) => count / size <= max_points);
      return this.extremes(names, first, end, level >= 0 ? level : kBuckets.length - 1);
    }
    return {
      time_s: Float64Array.from({ length: count }, (_, i) => (first + i) / this.rate_Hz),
      values: names.map((name) => {
        const { values } = this.channels.get(name)!;
        return Float32Array.from({ length: count }, (_, i) => values[(first + i) % this.capacity]);
      }),
      complete: true,
    };
  }

  private extremes(names: string[], first: number, end: number, level: number): Samples {
    const size = kBuckets[level];
    const begin = Math.ceil(first / size);
    const count = Math.max(Math.ceil(end / size) - begin, 0);
    const places = this.capacity / size;
    return {
      time_s: Float64Array.from({ length: 2 * count }, (_, i) => (size * (begin + i / 2) + size / 4) / this.rate_Hz),
      values: names.map((name) => {
        const { lowest, highest } = this.channels.get(name)!;
        const values = new Float32Array(2 * count);
        for (let i = 0; i < count; ++i) {
          values[2 * i] = lowest[level][(begin + i) % places];
          values[2 * i + 1] = highest[level][(begin + i) % places];
        }
        return values;
      }),
      complete: false,
    };
  }

  /** Every `step`-th sample of the range. */
  every(step: number, names: string[], begin_s: number, end_s: number): Float32Array[] {
    const first = step * Math.ceil(Math.max(begin_s * this.rate_Hz, this.end - this.capacity, 0) / step);
    const count = Math.max(Math.ceil((Math.min(end_s * this.rate_Hz, this.end) - first) / step), 0);
    return names.map((name) => {
      const { values } = this.channels.get(name)!;
      return Float32Array.from({ length: count }, (_, i) => values[(first + step * i) % this.capacity]);
    });
  }

  /** The channels of one panel as a figure takes them. */
  source(names: string[]): SampleSource {
    const samples = this;
    return {
      get begin_s() {
        return samples.begin_s;
      },
      get end_s() {
        return samples.end_s;
      },
      range: (begin_s, end_s, max_points) => samples.range(names, begin_s, end_s, max_points),
    };
  }
}
