import type { Numbers, XyFigure, XySeries } from "./document";
import { add_controls, add_legend, make_frame } from "./figure_frame";
import type { Frame, View } from "./figure_frame";
import { Scale, scale_of } from "./scale";
import { on_theme, scale_colour, series_colour, series_dash } from "./theme";
import { linear_ticks, log_ticks, tick_text } from "./ticks";

const kNamespace = "http://www.w3.org/2000/svg";
const kLeft = 64;
const kRight = 12;
const kTop = 8;
const kBottom = 44;
const kColourBins = 5;

interface Drawn {
  series: XySeries;
  x: Float32Array;
  y: Float32Array;
  colour: Float32Array | null;
  shown: boolean;
  css: string;
  dash: number[];
}

function element(parent: Element, name: string, attributes: Record<string, string | number>): SVGElement {
  const made = document.createElementNS(kNamespace, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  parent.append(made);
  return made;
}

/** Loops, scatter, columns and Bode diagrams: any x, in SVG, so that printing and zooming stay sharp. */
export class XyView implements View {
  private readonly frame: Frame;
  private readonly drawn: Drawn[];
  private readonly svg: SVGSVGElement;
  private x!: Scale;
  private y!: Scale;
  private width = 0;
  private height = 0;
  private is_fitted = true;

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
      return {
        series,
        x: numbers_of(series.x),
        y: numbers_of(series.y),
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
    this.fit();
    this.drag_to_zoom();
    new ResizeObserver(() => {
      if (this.frame.canvas.clientWidth !== this.width) this.draw();
    }).observe(this.frame.canvas);
    on_theme(() => this.draw());
  }

  zoom(factor: number): void {
    this.is_fitted = false;
    this.x.zoom(factor);
    this.y.zoom(factor);
    this.draw();
  }
  pan(right: number, up: number): void {
    this.is_fitted = false;
    this.x.pan(right);
    this.y.pan(up);
    this.draw();
  }
  reset(): void {
    this.is_fitted = true;
    this.fit();
    this.draw();
  }
  /** Replaces the points of all series; the axes contain all points unless a person has zoomed. */
  replace(points: [x: Float32Array, y: Float32Array][]): void {
    points.forEach(([x, y], index) => Object.assign(this.drawn[index], { x, y }));
    if (this.is_fitted) this.fit();
    this.draw();
  }

  private fit(): void {
    const shown = this.drawn.filter((one) => one.shown);
    const fitted = shown.length > 0 ? shown : this.drawn;
    const has_columns = fitted.some((one) => one.series.style === "columns");
    this.x = scale_of(fitted.map((one) => one.x), this.figure.x.log, has_columns ? 0.06 : 0.04);
    const heights = fitted.map((one) => one.y);
    if (has_columns) heights.push(new Float32Array([0]));
    this.y = scale_of(heights, this.figure.y.log);
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
    return 1 - (pixel - kTop) / (this.height - kTop - kBottom);
  }
  private pixel_x(value: number): number {
    return kLeft + this.x.share(value) * (this.width - kLeft - kRight);
  }
  private pixel_y(value: number): number {
    return kTop + (1 - this.y.share(value)) * (this.height - kTop - kBottom);
  }

  private show_position(x: number, y: number): void {
    const values = [this.x.value(this.share_x(x)), this.y.value(this.share_y(y))];
    this.frame.note.textContent =
      `${this.figure.x.label} ${values[0].toPrecision(4)}, ${this.figure.y.label} ${values[1].toPrecision(4)}` +
      (this.figure.colour_label ? `. Colour: ${this.figure.colour_label}` : "");
  }

  private draw(): void {
    this.width = Math.max(this.frame.canvas.clientWidth, 280);
    this.height = Math.round(Math.min(Math.max(0.6 * this.width, 240), 440));
    if (this.figure.equal) this.make_equal();
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    this.svg.setAttribute("width", String(this.width));
    this.svg.setAttribute("height", String(this.height));
    this.svg.replaceChildren();
    this.draw_axes();
    const clip = `clip-${this.figure.id}`;
    const path = element(element(this.svg, "defs", {}), "clipPath", { id: clip });
    const area = { x: kLeft, y: kTop, width: this.width - kLeft - kRight, height: this.height - kTop - kBottom };
    element(path, "rect", area);
    const layer = element(this.svg, "g", { "clip-path": `url(#${clip})` });
    for (const one of this.drawn) if (one.shown) this.draw_series(layer, one);
  }

  private make_equal(): void {
    const per_pixel = (scale: Scale, pixels: number) => (scale.high - scale.low) / pixels;
    const x = per_pixel(this.x, this.width - kLeft - kRight);
    const y = per_pixel(this.y, this.height - kTop - kBottom);
    if (x < y) this.x.zoom(y / x);
    else this.y.zoom(x / y);
  }

  private draw_axes(): void {
    const { figure } = this;
    const bottom = this.height - kBottom;
    const right = this.width - kRight;
    const x_ticks = figure.x.log
      ? log_ticks(this.x.low, this.x.high)
      : linear_ticks(this.x.low, this.x.high, Math.max(this.width / 90, 3));
    const y_ticks = figure.y.log ? log_ticks(this.y.low, this.y.high) : linear_ticks(this.y.low, this.y.high, 6);
    const names = this.drawn.find((one) => one.series.style === "columns" && one.series.names)?.series.names;
    for (const tick of x_ticks) {
      const x = this.pixel_x(tick);
      element(this.svg, "line", { x1: x, x2: x, y1: kTop, y2: bottom, class: "grid" });
      if (!names)
        element(this.svg, "text", { x, y: bottom + 16, class: "tick middle" }).textContent = tick_text(tick);
    }
    names?.forEach((name, column) => {
      element(this.svg, "text", { x: this.pixel_x(column), y: bottom + 16, class: "tick middle" }).textContent = name;
    });
    for (const tick of y_ticks) {
      const y = this.pixel_y(tick);
      element(this.svg, "line", { x1: kLeft, x2: right, y1: y, y2: y, class: "grid" });
      element(this.svg, "text", { x: kLeft - 6, y: y + 4, class: "tick end" }).textContent = tick_text(tick);
    }
    element(this.svg, "text", {
      x: 0.5 * (kLeft + right),
      y: this.height - 8,
      class: "label middle",
    }).textContent = figure.x.label;
    const middle = 0.5 * (kTop + bottom);
    element(this.svg, "text", {
      x: 14,
      y: middle,
      transform: `rotate(-90 14 ${middle})`,
      class: "label middle",
    }).textContent = figure.y.label;
  }

  private draw_series(layer: Element, one: Drawn): void {
    const { style } = one.series;
    if (style === "columns") return this.draw_columns(layer, one);
    const colours = one.colour ? kColourBins : 1;
    const range = one.colour ? scale_of([one.colour], false, 0) : null;
    const bin_of = (i: number) => {
      if (!one.colour || !range) return 0;
      const share = range.share(one.colour[i]);
      return Number.isFinite(share) ? Math.min(Math.max(Math.floor(share * colours), 0), colours - 1) : 0;
    };
    const paths: string[] = new Array<string>(colours).fill("");
    let pen = -1;
    for (let i = 0; i < one.x.length; ++i) {
      const [x, y] = [this.pixel_x(one.x[i]), this.pixel_y(one.y[i])];
      const bin = bin_of(i);
      if (!Number.isFinite(x) || !Number.isFinite(y)) {
        pen = -1;
        continue;
      }
      const point = `${x.toFixed(1)} ${y.toFixed(1)}`;
      if (style === "points") paths[bin] += `M${point}h0`;
      else if (pen < 0) paths[bin] += `M${point}`;
      else paths[pen] += `L${point}`;
      if (style === "line" && pen >= 0 && pen !== bin) paths[bin] += `M${point}`;
      pen = bin;
    }
    paths.forEach((d, bin) => {
      if (d === "") return;
      const stroke = one.colour ? scale_colour(bin / colours) : `var(${one.css})`;
      const path = element(layer, "path", { d, class: style === "points" ? "dots" : "curve" });
      path.style.stroke = stroke;
      // It can be seen below the model that follows it.
      if (style === "line" && one.series.role === "measured") path.style.strokeWidth = "3";
      if (one.dash.length > 0 && style === "line") path.style.strokeDasharray = one.dash.join(" ");
    });
    if (style === "points") this.name_points(layer, one);
  }

  private name_points(layer: Element, one: Drawn): void {
    one.series.names?.forEach((name, i) => {
      const x = this.pixel_x(one.x[i]);
      if (!Number.isFinite(x)) return;
      const is_right = x > 0.75 * this.width;
      element(layer, "text", {
        x: x + (is_right ? -6 : 6),
        y: this.pixel_y(one.y[i]) - 5,
        class: is_right ? "tick end" : "tick",
      }).textContent = name;
    });
  }

  private draw_columns(layer: Element, one: Drawn): void {
    const step = one.x.length > 1 ? Math.abs(one.x[1] - one.x[0]) : 1;
    const width = Math.max(0.85 * Math.abs(this.pixel_x(step) - this.pixel_x(0)), 1);
    const zero = this.pixel_y(0);
    for (let i = 0; i < one.x.length; ++i) {
      const y = this.pixel_y(one.y[i]);
      if (!Number.isFinite(y)) continue;
      const column = element(layer, "rect", {
        x: this.pixel_x(one.x[i]) - width / 2,
        y: Math.min(y, zero),
        width,
        height: Math.abs(zero - y),
        class: "column",
      });
      column.style.fill = `var(${one.css})`;
    }
  }
}
