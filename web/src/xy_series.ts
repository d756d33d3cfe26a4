// The curves, points and columns of a figure, and the names of points.
import type { XySeries } from "./document";
import { place_labels } from "./label_places";
import type { Box, Point } from "./label_places";
import { scale_of } from "./scale";
import { element, kLineHeight, text_width } from "./svg_elements";
import { scale_colour } from "./theme";

const kColourBins = 5;
/** So few are drawn larger. */
const kFewPoints = 50;
/** Lines with more points are not avoided by the names of points. */
const kMaxAvoided = 500;

export interface Drawn {
  series: XySeries;
  /** The numbers of the page, and the same in the unit of the angles. */
  stored: [x: Float32Array, y: Float32Array];
  x: Float32Array;
  y: Float32Array;
  colour: Float32Array | null;
  shown: boolean;
  css: string;
  dash: number[];
}

/** Where numbers are on the screen. */
export interface Plane {
  pixel_x(value: number): number;
  pixel_y(value: number): number;
  area(): Box;
}

export function column_step(x: Float32Array): number {
  return x.length > 1 ? Math.abs(x[1] - x[0]) : 1;
}

export function draw_series(plane: Plane, layer: Element, one: Drawn): void {
  const { style } = one.series;
  if (style === "columns") return draw_columns(plane, layer, one);
  const colours = one.colour ? kColourBins : 1;
  const range = one.colour ? scale_of([one.colour], false, 0) : null;
  const bin_of = (i: number) => {
    if (!one.colour || !range) return 0;
    const share = range.share(one.colour[i]);
    return Number.isFinite(share) ? Math.min(Math.max(Math.floor(share * colours), 0), colours - 1) : 0;
  };
  const { left, top, width, height } = plane.area();
  /** On which sides of the area a point is. */
  const sides = (x: number, y: number) =>
    (x < left ? 1 : x > left + width ? 2 : 0) | (y < top ? 4 : y > top + height ? 8 : 0);
  const paths: string[] = new Array<string>(colours).fill("");
  let pen = -1;
  let before: Point = [NaN, NaN];
  for (let i = 0; i < one.x.length; ++i) {
    const [x, y] = [plane.pixel_x(one.x[i]), plane.pixel_y(one.y[i])];
    const bin = bin_of(i);
    if (!Number.isFinite(x) || !Number.isFinite(y)) {
      pen = -1;
      before = [NaN, NaN];
      continue;
    }
    const [x0, y0] = before;
    before = [x, y];
    const outside = sides(x, y);
    if (style === "points") {
      if (outside === 0) paths[bin] += `M${x.toFixed(1)} ${y.toFixed(1)}h0`;
      continue;
    }
    // A segment that is all on one side of the area is not drawn.
    if (Number.isNaN(x0) || (outside & sides(x0, y0)) !== 0) {
      pen = -1;
      continue;
    }
    if (pen !== bin) paths[bin] += `M${x0.toFixed(1)} ${y0.toFixed(1)}`;
    paths[bin] += `L${x.toFixed(1)} ${y.toFixed(1)}`;
    pen = bin;
  }
  paths.forEach((d, bin) => {
    if (d === "") return;
    const stroke = one.colour ? scale_colour(bin / colours) : `var(${one.css})`;
    const path = element(layer, "path", { d, class: style === "points" ? "dots" : "curve" });
    path.style.stroke = stroke;
    // It can be seen below the model that follows it.
    if (style === "line" && one.series.role === "measured") path.style.strokeWidth = "3";
    if (style === "points" && one.x.length <= kFewPoints) path.style.strokeWidth = "7";
    if (one.dash.length > 0 && style === "line") path.style.strokeDasharray = one.dash.join(" ");
  });
}

/** The names of all points, not over each other and away from the lines where possible. */
export function draw_point_names(plane: Plane, layer: Element, drawn: Drawn[]): void {
  const area = plane.area();
  const is_inside = ([x, y]: Point) =>
    x >= area.left && x <= area.left + area.width && y >= area.top && y <= area.top + area.height;
  const points: Point[] = [];
  const names: string[] = [];
  const lines: [Point, Point][] = [];
  for (const one of drawn) {
    if (!one.shown) continue;
    const at = (i: number): Point => [plane.pixel_x(one.x[i]), plane.pixel_y(one.y[i])];
    if (one.series.style === "points")
      one.series.names?.forEach((name, i) => {
        if (!is_inside(at(i))) return;
        points.push(at(i));
        names.push(name);
      });
    else if (one.series.style === "line" && one.x.length <= kMaxAvoided)
      for (let i = 1; i < one.x.length; ++i) lines.push([at(i - 1), at(i)]);
  }
  if (names.length === 0) return;
  const sizes = names.map((name): Point => [text_width(name) + 2, kLineHeight]);
  place_labels(points, sizes, area, lines).forEach((place, i) => {
    if (!place) return;
    const [x, y] = points[i];
    const middle = place.top + place.height / 2;
    if (place.is_far) {
      const x2 = Math.min(Math.max(x, place.left), place.left + place.width);
      element(layer, "line", { x1: x, y1: y, x2, y2: middle < y ? middle + 5 : middle - 5, class: "leader" });
    }
    element(layer, "text", { x: place.left + 1, y: middle + 4, class: "tick" }).textContent = names[i];
  });
}

function draw_columns(plane: Plane, layer: Element, one: Drawn): void {
  const step = column_step(one.x);
  const width = Math.max(0.85 * Math.abs(plane.pixel_x(step) - plane.pixel_x(0)), 1);
  const zero = plane.pixel_y(0);
  for (let i = 0; i < one.x.length; ++i) {
    const y = plane.pixel_y(one.y[i]);
    if (!Number.isFinite(y)) continue;
    const column = element(layer, "rect", {
      x: plane.pixel_x(one.x[i]) - width / 2,
      y: Math.min(y, zero),
      width,
      height: Math.abs(zero - y),
      class: "column",
    });
    column.style.fill = `var(${one.css})`;
  }
}
