import uPlot from "uplot";
import { angle_channel, angle_factor, angle_text, is_angle, on_angle_unit, scaled } from "./angles";
import type { TimeFigure, TimePanel, TimeSeries } from "./document";
import { add_controls, add_legend, kRest_ms, make_frame } from "./figure_frame";
import type { Frame, LegendEntry, View } from "./figure_frame";
import type { SampleSource, Samples } from "./sample_source";
import { css_colour, on_theme, series_colour, series_dash } from "./theme";
import { draw_mark_names, draw_marks, draw_value_names, mark_names_at, named_values } from "./time_marks";

const kFirstPanelHeight = 300;
const kPanelHeight = 170;
const kCompactHeight = 110;
/** A measured curve can be seen below the model that follows it. */
const kWidths: Record<string, number> = { measured: 3, lower: 0.5, upper: 0.5 };
const kMaxPoints = 2000;
const kLiveWidth = 1;
/** Part of a panel's height above and below values with names. */
const kNameMargin = 0.35;

interface Panel {
  label: string;
  plot: uPlot;
  source: SampleSource;
  /** Whether the panel is on or near the screen: others are drawn when they come there. */
  is_near: boolean;
  /** The range of time that was drawn last. */
  drawn: [number, number] | null;
}

/** Without NaN, which uPlot would draw: null is a gap. */
function with_gaps(values: Float32Array): Float32Array | (number | null)[] {
  return values.some(Number.isNaN) ? Array.from(values, (value) => (Number.isNaN(value) ? null : value)) : values;
}

/** Panels of time series under each other, with one range of time. */
export class TimeView implements View {
  private readonly frame: Frame;
  private readonly panels: Panel[] = [];
  /** The index of the colour of each curve. */
  private readonly colours = new Map<string, number>();
  private view: [number, number];
  private is_waiting = false;
  private rest = 0;

  /** @param source_of the samples of the series of one panel */
  constructor(
    place: HTMLElement,
    private readonly figure: TimeFigure,
    source_of: (series: TimeSeries[]) => SampleSource,
  ) {
    this.frame = make_frame(place, figure.title);
    this.frame.marks.hidden = figure.marks.length === 0;
    const entries: (LegendEntry & { at: [panel: number, series: number][] })[] = [];
    const { colours } = this;
    figure.panels.forEach((panel, p) => {
      panel.series.forEach((series, s) => {
        const index = colour_index(colours, series);
        const css = series_colour(series.role, index);
        const known = entries.find((entry) => entry.label === series.label);
        if (known) known.at.push([p, s + 1]);
        else entries.push({ label: series.label, colour: css, shown: series.shown, at: [[p, s + 1]] });
      });
    });
    figure.panels.forEach((panel, p) => {
      const plot = this.make_plot(panel, p);
      this.panels.push({ label: panel.label, plot, source: source_of(panel.series), is_near: true, drawn: null });
    });
    this.view = [this.begin_s, this.end_s];
    add_controls(this.frame, this);
    this.add_windows();
    const rename = add_legend(this.frame, entries, (index, shown) => {
      for (const [panel, series] of entries[index].at) this.panels[panel].plot.setSeries(series, { show: shown });
      this.hide_empty_panels();
    });
    this.update();
    this.hide_empty_panels();
    this.watch_panels();
    new ResizeObserver(() => this.resize()).observe(this.frame.canvas);
    on_theme(() => this.panels.forEach(({ plot }) => plot.redraw(false)));
    const use_angle_unit = () => {
      rename((name, index) => (is_angle(figure.panels[entries[index].at[0][0]].label) ? angle_channel(name) : name));
      for (const panel of this.panels) {
        panel.plot.axes[1].label = angle_text(panel.label);
        panel.drawn = null;
      }
    };
    on_angle_unit(() => {
      use_angle_unit();
      this.update();
    });
    use_angle_unit();
  }

  private get begin_s(): number {
    return Math.min(...this.panels.map((panel) => panel.source.begin_s));
  }
  private get end_s(): number {
    return Math.max(...this.panels.map((panel) => panel.source.end_s));
  }

  zoom(factor: number): void {
    const middle = 0.5 * (this.view[0] + this.view[1]);
    const half = 0.5 * factor * (this.view[1] - this.view[0]);
    this.show(middle - half, middle + half);
  }
  pan(right: number): void {
    const width = this.view[1] - this.view[0];
    const begin = Math.min(Math.max(this.view[0] + right * width, this.begin_s), this.end_s - width);
    this.show(begin, begin + width);
  }
  reset(): void {
    this.show(this.begin_s, this.end_s);
  }
  /** The range of time that is shown. */
  get range(): [number, number] {
    return this.view;
  }

  show(begin_s: number, end_s: number): void {
    const shortest = 4 / this.figure.rate_Hz;
    const begin = Math.max(begin_s, this.begin_s);
    const end = Math.min(Math.max(end_s, begin + shortest), this.end_s);
    this.view = [Math.min(begin, end - shortest), end];
    this.use_thin_lines();
    if (this.is_waiting) return;
    this.is_waiting = true;
    requestAnimationFrame(() => {
      this.is_waiting = false;
      this.update();
    });
  }

  /** Until the range of time is at rest. */
  private use_thin_lines(): void {
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      this.set_widths(false);
      this.panels.forEach(({ plot, is_near }) => is_near && plot.redraw(false));
    }, kRest_ms);
    this.set_widths(true);
  }

  private set_widths(is_thin: boolean): void {
    this.panels.forEach(({ plot }, p) =>
      this.figure.panels[p].series.forEach((series, s) => {
        plot.series[s + 1].width = is_thin ? 1 : this.line_width(series);
        plot.series[s + 1].dash = is_thin ? [] : this.line_dash(series);
      }),
    );
  }

  private line_width(series: TimeSeries): number {
    return this.figure.live ? kLiveWidth : (kWidths[series.role] ?? 1.25);
  }
  private line_dash(series: TimeSeries): number[] {
    return series.role === "limit" ? [4, 4] : series_dash(this.colours.get(colour_key(series)) ?? 0);
  }

  /** Draws this range at once, also beyond the samples: that of a joint that is running. */
  show_now(begin_s: number, end_s: number): void {
    this.view = [begin_s, end_s];
    this.update();
  }

  private update(): void {
    const [begin, end] = this.view;
    let shown: Samples | undefined;
    for (const panel of this.panels) {
      const is_drawn = panel.drawn?.[0] === begin && panel.drawn[1] === end;
      if (is_drawn || !panel.is_near || panel.plot.root.hidden) continue;
      panel.drawn = [begin, end];
      const samples = panel.source.range(begin, end, this.figure.live ? this.width() / 4 : kMaxPoints);
      shown = samples;
      const factor = angle_factor(panel.label);
      const values = samples.values.map((one) => with_gaps(scaled(one, factor)));
      panel.plot.batch(() => {
        panel.plot.setData([samples.time_s, ...values] as unknown as uPlot.AlignedData, false);
        panel.plot.setScale("x", { min: begin, max: end });
      });
    }
    this.frame.canvas.dataset.range = `${begin} ${end}`;
    if (!shown) return;
    const note = shown.complete
      ? "Every sample is shown."
      : `Lines show minima and maxima; ${where_detail_ends(this.figure)}.`;
    if (this.frame.note.textContent !== note) this.frame.note.textContent = note;
  }

  private hide_empty_panels(): void {
    for (const { plot } of this.panels) plot.root.hidden = !plot.series.slice(1).some((one) => one.show);
    this.update();
  }

  /** Panels that cannot be seen are not drawn while the range of time moves; before printing all are. */
  private watch_panels(): void {
    const near = new IntersectionObserver(
      (entries) => {
        for (const { target, isIntersecting } of entries) {
          const panel = this.panels.find(({ plot }) => plot.root === target);
          if (panel) panel.is_near = isIntersecting;
        }
        this.update();
      },
      { rootMargin: "100px" },
    );
    this.panels.forEach(({ plot }) => near.observe(plot.root));
    addEventListener("beforeprint", () => {
      this.panels.forEach((panel) => (panel.is_near = true));
      this.update();
    });
  }

  /** The names of the ranges below the pointer. */
  private note_marks(plot: uPlot): void {
    const { left } = plot.cursor;
    const names = left !== undefined && left >= 0 ? mark_names_at(plot, this.figure.marks, left) : "";
    this.frame.marks.textContent = names;
  }

  private height(index: number): number {
    if (this.figure.compact) return kCompactHeight;
    return index === 0 ? kFirstPanelHeight : kPanelHeight;
  }
  private width(): number {
    return Math.max(this.frame.canvas.clientWidth, 280);
  }

  private resize(): void {
    this.panels.forEach(({ plot }, index) => {
      if (plot.width !== this.width()) plot.setSize({ width: this.width(), height: this.height(index) });
    });
  }

  private add_windows(): void {
    if (this.figure.windows.length === 0) return;
    const label = document.createElement("label");
    const list = document.createElement("select");
    list.append(new Option("all", ""));
    this.figure.windows.forEach((window, index) => list.append(new Option(window.label, String(index))));
    list.addEventListener("change", () => {
      if (list.value === "") return this.reset();
      const window = this.figure.windows[Number(list.value)];
      const time_at = (sample: number) => this.figure.start_s + sample / this.figure.rate_Hz;
      this.show(time_at(window.begin), time_at(window.end - 1));
    });
    label.append("Show ", list);
    this.frame.toolbar.append(label);
  }

  private make_plot({ label, series, names }: TimePanel, index: number): uPlot {
    const grid = () => css_colour("--grid");
    const text = () => css_colour("--text");
    const axis = { stroke: text, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1 } };
    const is_last = index + 1 === this.figure.panels.length;
    return new uPlot(
      {
        width: this.width(),
        height: this.height(index),
        scales: { x: { time: false, auto: false }, ...(names ? { y: { range: named_range } } : {}) },
        legend: { show: false },
        cursor: {
          drag: { x: true, y: false, setScale: false },
          sync: { key: this.figure.id },
          bind: { dblclick: () => null },
        },
        axes: [
          { ...axis, label: is_last ? "time [s]" : undefined, size: is_last ? 40 : 28 },
          { ...axis, label, size: 64, ...(names ? named_axis(names) : {}) },
        ],
        series: [
          {},
          ...series.map((one) => ({
            label: one.label,
            show: one.shown,
            stroke: () => css_colour(series_colour(one.role, this.colours.get(colour_key(one)) ?? 0)),
            dash: this.line_dash(one),
            width: this.line_width(one),
            points: { show: false },
          })),
        ],
        bands: bands_of(series),
        hooks: {
          drawClear: [(plot: uPlot) => draw_marks(plot, this.figure.marks)],
          draw: [
            (plot: uPlot) => {
              if (index === 0) draw_mark_names(plot, this.figure.marks);
              if (names) draw_value_names(plot, names);
            },
          ],
          setCursor: [(plot: uPlot) => this.note_marks(plot)],
          setSelect: [
            (plot: uPlot) => {
              if (plot.select.width < 4) return;
              this.show(plot.posToVal(plot.select.left, "x"), plot.posToVal(plot.select.left + plot.select.width, "x"));
              plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
            },
          ],
        },
      },
      [[], ...series.map(() => [])] as unknown as uPlot.AlignedData,
      this.frame.canvas,
    );
  }
}

function where_detail_ends(figure: TimeFigure): string {
  const stored = figure.windows.reduce((sum, window) => sum + window.end - window.begin, 0);
  return stored === figure.samples
    ? "zoom in to see every sample"
    : `every sample is in this file only for the ${figure.windows.length} places in the list above, ` +
        `elsewhere minima and maxima of ${figure.bucket} samples`;
}

/** A model has one colour in all panels, and so have its error band and its residual. */
function colour_key(series: TimeSeries): string {
  return series.label.replace(/ (lower bound|upper bound|residual)$/, "");
}

function colour_index(colours: Map<string, number>, series: TimeSeries): number {
  const key = colour_key(series);
  if (series.role !== "measured" && series.role !== "limit" && !colours.has(key)) colours.set(key, colours.size);
  return colours.get(key) ?? 0;
}

/** An axis whose values have names in the panel instead of numbers beside it. */
function named_axis(names: string[]): Partial<uPlot.Axis> {
  return { splits: (plot) => named_values(plot, names), values: (_, splits) => splits.map(() => "") };
}

function named_range(_: uPlot, lowest: number, highest: number): uPlot.Range.MinMax {
  const margin = kNameMargin * Math.max(highest - lowest, 1);
  return [lowest - margin, highest + margin];
}

function bands_of(series: TimeSeries[]): uPlot.Band[] {
  const bands: uPlot.Band[] = [];
  series.forEach((one, index) => {
    if (one.role === "upper") bands.push({ series: [index + 1, index], fill: () => css_colour("--band") });
  });
  return bands;
}
