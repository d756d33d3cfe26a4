import { angle_factor, angle_text, on_angle_unit, scaled } from "./angles";
import type { Numbers, XyFigure } from "./document";
import { add_controls, add_legend, kRest_ms, make_frame } from "./figure_frame";
import type { Frame, View } from "./figure_frame";
import type { Box } from "./label_places";
import { Scale, scale_of } from "./scale";
import { element, kLabelSize, kLineHeight, kNamespace, kTickSize, shortened, text_width } from "./svg_elements";
import { on_theme, series_colour, series_dash } from "./theme";
import { linear_ticks, log_ticks, tick_text } from "./ticks";
import { column_step, draw_point_names, draw_series } from "./xy_series";
import type { Drawn, Plane } from "./xy_series";

const kLeft = 64;
const kRight = 12;
const kTop = 8;
const kBottom = 44;

/** Loops, scatter, columns and Bode diagrams: any x, in SVG, so that printing and zooming stay sharp. */
export class XyView implements View, Plane {
  private readonly frame: Frame;
  private readonly drawn: Drawn[];
  private readonly svg: SVGSVGElement;
  private x!: Scale;
  private y!: Scale;
  private width = 0;
  private height = 0;
  /** Below the area: numbers or names, and the label of the axis. */
  private bottom = kBottom;
  private is_fitted = true;
  private is_waiting = false;
  private rest = 0;

  /** @param numbers_of the numbers of a series */
  constructor(
    place: HTMLElement,
    private readonly figure: XyFigure,
    numbers_of: (numbers: Numbers) => Float32Array,
  ) {
    this.frame = make_frame(place, figure.title);
    let models = 0;
    this.drawn = figure.series.map((series) => {
      const index = series.role === "model" ? models++ : 0;
      const stored: Drawn["stored"] = [numbers_of(series.x), numbers_of(series.y)];
      return {
        series,
        stored,
        x: stored[0],
        y: stored[1],
        colour: series.colour ? numbers_of(series.colour) : null,
        shown: series.shown,
        css: series_colour(series.role, index),
        dash: series.role === "limit" ? [4, 4] : series_dash(index),
      };
    });
    this.svg = document.createElementNS(kNamespace, "svg");
    this.svg.setAttribute("role", "img");
    this.svg.setAttribute("aria-label", figure.title);
    this.frame.canvas.append(this.svg);
    add_controls(this.frame, this);
    if (this.drawn.length > 1)
      add_legend(
        this.frame,
        this.drawn.map((one) => ({ label: one.series.label, colour: one.css, shown: one.shown })),
        (index, shown) => {
          this.drawn[index].shown = shown;
          this.draw();
        },
      );
    this.use_angle_unit();
    this.reset();
    this.drag_to_zoom();
    new ResizeObserver(() => {
      if (this.frame.canvas.clientWidth === this.width) return;
      if (this.is_fitted) this.fit();
      this.draw();
    }).observe(this.frame.canvas);
    on_theme(() => this.draw());
    on_angle_unit(() => {
      this.use_angle_unit();
      this.reset();
    });
  }

  zoom(factor: number): void {
    this.is_fitted = false;
    this.x.zoom(factor);
    this.y.zoom(factor);
    this.draw_soon();
  }
  pan(right: number, up: number): void {
    this.is_fitted = false;
    this.x.pan(right);
    this.y.pan(up);
    this.draw_soon();
  }
  reset(): void {
    this.is_fitted = true;
    this.fit();
    this.draw();
  }
  /** Replaces the points of all series; the axes contain all points unless a person has zoomed. */
  replace(points: [x: Float32Array, y: Float32Array][]): void {
    points.forEach((stored, index) => (this.drawn[index].stored = stored));
    this.use_angle_unit();
    if (this.is_fitted) this.fit();
    this.draw();
  }

  private use_angle_unit(): void {
    const { x, y } = this.figure;
    for (const one of this.drawn) {
      one.x = scaled(one.stored[0], angle_factor(x.label));
      one.y = scaled(one.stored[1], angle_factor(y.label));
    }
  }

  private fit(): void {
    const shown = this.drawn.filter((one) => one.shown);
    const fitted = shown.length > 0 ? shown : this.drawn;
    const columns = fitted.filter((one) => one.series.style === "columns");
    const ends = columns.map(({ x }) => {
      const half = 0.5 * column_step(x);
      return new Float32Array([x[0] - half, x[x.length - 1] + half]);
    });
    this.x = scale_of([...fitted.map((one) => one.x), ...ends], this.figure.x.log, columns.length > 0 ? 0.01 : 0.04);
    const heights = fitted.map((one) => one.y);
    if (columns.length > 0) heights.push(new Float32Array([0]));
    this.y = scale_of(heights, this.figure.y.log);
  }

  /** Once for all events of a frame; with thin lines until the last of them. */
  private draw_soon(): void {
    this.svg.classList.add("moving");
    clearTimeout(this.rest);
    this.rest = setTimeout(() => this.svg.classList.remove("moving"), kRest_ms);
    if (this.is_waiting) return;
    this.is_waiting = true;
    requestAnimationFrame(() => {
      this.is_waiting = false;
      this.draw();
    });
  }

  private drag_to_zoom(): void {
    let start: [number, number] | null = null;
    let box: SVGElement | null = null;
    const at = (event: PointerEvent): [number, number] => {
      const border = this.svg.getBoundingClientRect();
      return [event.clientX - border.left, event.clientY - border.top];
    };
    this.svg.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch" || event.button !== 0) return;
      start = at(event);
      this.svg.setPointerCapture(event.pointerId);
    });
    this.svg.addEventListener("pointermove", (event) => {
      const [x, y] = at(event);
      this.show_position(x, y);
      if (!start) return;
      box?.remove();
      box = element(this.svg, "rect", {
        x: Math.min(x, start[0]),
        y: Math.min(y, start[1]),
        width: Math.abs(x - start[0]),
        height: Math.abs(y - start[1]),
        class: "selection",
      });
    });
    this.svg.addEventListener("pointerup", (event) => {
      if (!start) return;
      const [x, y] = at(event);
      const [x0, y0] = start;
      start = null;
      box?.remove();
      if (Math.abs(x - x0) < 8 || Math.abs(y - y0) < 8) return;
      this.is_fitted = false;
      this.x.show(this.share_x(Math.min(x, x0)), this.share_x(Math.max(x, x0)));
      this.y.show(this.share_y(Math.max(y, y0)), this.share_y(Math.min(y, y0)));
      this.draw();
    });
  }

  private share_x(pixel: number): number {
    return (pixel - kLeft) / (this.width - kLeft - kRight);
  }
  private share_y(pixel: number): number {
    return 1 - (pixel - kTop) / (this.height - kTop - this.bottom);
  }
  pixel_x(value: number): number {
    return kLeft + this.x.share(value) * (this.width - kLeft - kRight);
  }
  pixel_y(value: number): number {
    return kTop + (1 - this.y.share(value)) * (this.height - kTop - this.bottom);
  }

  private show_position(x: number, y: number): void {
    const values = [this.x.value(this.share_x(x)), this.y.value(this.share_y(y))];
    this.frame.note.textContent =
      `${angle_text(this.figure.x.label)} ${values[0].toPrecision(4)}, ` +
      `${angle_text(this.figure.y.label)} ${values[1].toPrecision(4)}` +
      (this.figure.colour_label ? `. Colour: ${this.figure.colour_label}` : "");
  }

  private draw(): void {
    this.width = Math.max(this.frame.canvas.clientWidth, 280);
    this.height = Math.round(Math.min(Math.max(0.6 * this.width, 240), 440));
    this.bottom = kBottom + (this.name_rows() - 1) * kLineHeight;
    if (this.figure.equal) this.make_equal();
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    this.svg.setAttribute("width", String(this.width));
    this.svg.setAttribute("height", String(this.height));
    this.svg.replaceChildren();
    this.draw_axes();
    const clip = `clip-${this.figure.id}`;
    const path = element(element(this.svg, "defs", {}), "clipPath", { id: clip });
    const { left: x, top: y, width, height } = this.area();
    element(path, "rect", { x, y, width, height });
    const layer = element(this.svg, "g", { "clip-path": `url(#${clip})` });
    for (const one of this.drawn) if (one.shown) draw_series(this, layer, one);
    draw_point_names(this, layer, this.drawn);
  }

  area(): Box {
    return { left: kLeft, top: kTop, width: this.width - kLeft - kRight, height: this.height - kTop - this.bottom };
  }

  /** The names below the columns. */
  private column_names(): string[] | undefined {
    return this.drawn.find((one) => one.series.style === "columns" && one.series.names)?.series.names;
  }

  /** Rows for the names below the columns, so that neighbours do not overlap. */
  private name_rows(): number {
    const names = this.column_names();
    if (!names) return 1;
    const step = this.pixel_x(1) - this.pixel_x(0);
    const widest = Math.max(...names.map((name) => text_width(name)));
    return Math.min(Math.max(Math.ceil((widest + 8) / step), 1), names.length);
  }

  private make_equal(): void {
    const per_pixel = (scale: Scale, pixels: number) => (scale.high - scale.low) / pixels;
    const x = per_pixel(this.x, this.width - kLeft - kRight);
    const y = per_pixel(this.y, this.height - kTop - this.bottom);
    if (x < y) this.x.zoom(y / x);
    else this.y.zoom(x / y);
  }

  /** Below the area and within the figure. */
  private write_below(at: number, row: number, text: string): void {
    const half = 0.5 * text_width(text);
    const x = Math.max(Math.min(at, this.width - half - 2), half + 2);
    const y = this.height - this.bottom + 16 + row * kLineHeight;
    element(this.svg, "text", { x, y, class: "tick middle" }).textContent = text;
  }

  private draw_axes(): void {
    const { figure } = this;
    const bottom = this.height - this.bottom;
    const right = this.width - kRight;
    const columns = Math.max(this.width / 90, 3);
    const x_ticks = figure.x.log
      ? log_ticks(this.x.low, this.x.high, columns)
      : linear_ticks(this.x.low, this.x.high, columns);
    const y_ticks = figure.y.log ? log_ticks(this.y.low, this.y.high, 9) : linear_ticks(this.y.low, this.y.high, 6);
    const names = this.column_names();
    for (const tick of x_ticks) {
      const x = this.pixel_x(tick);
      element(this.svg, "line", { x1: x, x2: x, y1: kTop, y2: bottom, class: "grid" });
      if (!names) this.write_below(x, 0, tick_text(tick));
    }
    const rows = this.name_rows();
    names?.forEach((name, column) => {
      const at = this.pixel_x(column);
      if (at < kLeft || at > right) return;
      this.write_below(at, column % rows, name);
    });
    for (const tick of y_ticks) {
      const y = this.pixel_y(tick);
      element(this.svg, "line", { x1: kLeft, x2: right, y1: y, y2: y, class: "grid" });
      element(this.svg, "text", { x: kLeft - 6, y: y + 4, class: "tick end" }).textContent = tick_text(tick);
    }
    const middle = 0.5 * (kTop + bottom);
    this.write_label({ x: 0.5 * this.width, y: this.height - 8 }, this.width, figure.x.label);
    const upright = { x: 14, y: middle, transform: `rotate(-90 14 ${middle})` };
    this.write_label(upright, 2 * Math.min(middle, this.height - middle), figure.y.label);
  }

  /** The label of an axis, shortened where it has no room; the whole of it is its title. */
  private write_label(at: Record<string, string | number>, room: number, label: string): void {
    const text = angle_text(label);
    const written = element(this.svg, "text", { ...at, class: "label middle" });
    written.textContent = shortened(text, room - 8, kLabelSize / kTickSize);
    if (written.textContent !== text) element(written, "title", {}).textContent = text;
  }
}
