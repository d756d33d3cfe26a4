// What is drawn in a panel of time series besides its curves: shaded ranges with their names, names of values.
import type uPlot from "uplot";
import type { Mark } from "./document";
import { css_colour } from "./theme";

const kFont = '12px "DejaVu Sans", system-ui, sans-serif';
const kLineHeight = 14;

function edges(plot: uPlot, mark: Mark): [number, number] | null {
  const { left, width } = plot.bbox;
  const begin = Math.max(plot.valToPos(mark.begin_s, "x", true), left);
  const end = Math.min(plot.valToPos(mark.end_s, "x", true), left + width);
  return end >= begin ? [begin, end] : null;
}

/** Guards, faults and findings as shaded ranges of time. */
export function draw_marks(plot: uPlot, marks: Mark[]): void {
  const { top, height } = plot.bbox;
  for (const mark of marks) {
    const shown = edges(plot, mark);
    if (!shown) continue;
    plot.ctx.fillStyle = css_colour(mark.level === "fail" ? "--fail-area" : "--warn-area");
    plot.ctx.fillRect(shown[0], top, Math.max(shown[1] - shown[0], 2), height);
  }
}

/** Runs a function with the letters of the figure, in pixels of the screen. */
function write(plot: uPlot, use: (context: CanvasRenderingContext2D, ratio: number) => void): void {
  const ratio = devicePixelRatio || 1;
  plot.ctx.save();
  plot.ctx.font = kFont.replace("12", String(12 * ratio));
  plot.ctx.fillStyle = css_colour("--text");
  plot.ctx.textBaseline = "top";
  plot.ctx.textAlign = "left";
  use(plot.ctx, ratio);
  plot.ctx.restore();
}

function shortened(context: CanvasRenderingContext2D, text: string, room: number): string {
  if (context.measureText(text).width <= room) return text;
  let length = text.length;
  while (length > 4 && context.measureText(`${text.slice(0, length)}…`).width > room) --length;
  return `${text.slice(0, length)}…`;
}

/** The names of the ranges in up to three rows at the top of a panel; the note has those that have no room. */
export function draw_mark_names(plot: uPlot, marks: Mark[]): void {
  const { left, top, width } = plot.bbox;
  write(plot, (context, ratio) => {
    const free_from = [left, left, left];
    let last = "";
    for (const mark of marks) {
      const shown = edges(plot, mark);
      if (!shown || mark.label === last) continue;
      const text = shortened(context, mark.label, 0.6 * width);
      const text_width = context.measureText(text).width;
      const begin = Math.max(Math.min(shown[0] + 3 * ratio, left + width - text_width - 3 * ratio), left);
      const row = free_from.findIndex((from) => from <= begin);
      if (row < 0) continue;
      last = mark.label;
      free_from[row] = begin + text_width + 8 * ratio;
      context.fillText(text, begin, top + (3 + row * kLineHeight) * ratio);
    }
  });
}

/** The names of the ranges at a time. */
export function mark_names_at(plot: uPlot, marks: Mark[], left: number): string {
  const names = marks
    .filter((mark) => {
      const [begin, end] = [plot.valToPos(mark.begin_s, "x"), plot.valToPos(mark.end_s, "x")];
      return left >= begin - 3 && left <= Math.max(end, begin) + 3;
    })
    .map((mark) => mark.label);
  return [...new Set(names)].join("; ");
}

/** Values with a name that occur in the present range. */
export function named_values(plot: uPlot, names: string[]): number[] {
  const found = new Set<number>();
  for (const values of plot.data.slice(1))
    for (const value of values) if (typeof value === "number" && names[value] !== undefined) found.add(value);
  return [...found].sort((a, b) => a - b);
}

/** The names of values, above their lines of the grid. */
export function draw_value_names(plot: uPlot, names: string[]): void {
  const { left, top } = plot.bbox;
  write(plot, (context, ratio) => {
    context.textBaseline = "bottom";
    for (const value of named_values(plot, names)) {
      const y = Math.max(plot.valToPos(value, "y", true), top + kLineHeight * ratio);
      context.fillText(names[value], left + 4 * ratio, y - 2 * ratio);
    }
  });
}
