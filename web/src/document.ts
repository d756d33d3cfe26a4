// The figures of a report as the program wrote them: JSON that refers to numbers in one block of base64.

/** First number and count in the block of numbers. */
export type Numbers = [first: number, count: number];

export interface Axis {
  label: string;
  log: boolean;
}

export interface XySeries {
  label: string;
  style: "line" | "points" | "columns";
  role: "measured" | "model" | "limit";
  shown: boolean;
  x: Numbers;
  y: Numbers;
  /** A value of each point that selects its colour: time or speed. */
  colour?: Numbers;
  /** A name of each point. */
  names?: string[];
}

export interface XyFigure {
  kind: "xy";
  id: string;
  title: string;
  x: Axis;
  y: Axis;
  /** One unit is as long on both axes. */
  equal: boolean;
  colour_label?: string;
  series: XySeries[];
}

export interface TimeSeries {
  label: string;
  role: "measured" | "model" | "limit" | "lower" | "upper";
  shown: boolean;
  /** Two values of each bucket, its minimum and maximum in the order of their time. */
  overview: Numbers;
  /** Every sample of the windows, one window after the other. */
  detail: Numbers;
}

export interface Window {
  begin: number;
  end: number;
  label: string;
}

export interface Mark {
  begin_s: number;
  end_s: number;
  label: string;
  level: "warn" | "fail";
}

export interface TimePanel {
  label: string;
  series: TimeSeries[];
  /** The names of the values 0, 1, ..: of faults and states. */
  names?: string[];
}

export interface TimeFigure {
  kind: "time";
  id: string;
  title: string;
  start_s: number;
  rate_Hz: number;
  samples: number;
  /** Samples in a bucket of the overview. */
  bucket: number;
  windows: Window[];
  marks: Mark[];
  panels: TimePanel[];
  /** Low panels, for an overview of many. */
  compact?: boolean;
  /** It moves: thin lines with few points, which are drawn in a short time. */
  live?: boolean;
}

export type Figure = XyFigure | TimeFigure;

export interface Report {
  figures: Figure[];
  numbers: Float32Array;
}

function text_of(id: string): string {
  return document.getElementById(id)?.textContent ?? "";
}

export function read_report(): Report {
  const bytes = Uint8Array.from(atob(text_of("report-numbers")), (letter) => letter.charCodeAt(0));
  return { figures: JSON.parse(text_of("report-figures")) as Figure[], numbers: new Float32Array(bytes.buffer) };
}

export function slice(report: Report, [first, count]: Numbers): Float32Array {
  return report.numbers.subarray(first, first + count);
}
