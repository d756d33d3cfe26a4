// Where the names of points are written: beside their points, within the area, and not over each other.

export type Point = [x: number, y: number];

export interface Box {
  left: number;
  top: number;
  width: number;
  height: number;
}

/** The box of a label; `is_far`: a line to its point is drawn. */
export interface LabelPlace extends Box {
  is_far: boolean;
}

const kDistances = [7, 16, 28, 42, 58, 76];
/** To the right first, then up, down and to the left. */
const kDirections: Point[] = [0, -45, 45, 180, -135, 135, -90, 90, -20, 20, 160, -160].map((degrees) => {
  const angle = (degrees * Math.PI) / 180;
  return [Math.cos(angle), Math.sin(angle)];
});
const kPointRadius = 4;
const kLineCost = 12;
/** A label that another point is nearly as close to as its own. */
const kDoubtCost = 25;
const kDoubtRadius = 8;
/** A line from a label to its point that crosses another label or point. */
const kLeaderCost = 20;

export function overlap(a: Box, b: Box): boolean {
  return a.left < b.left + b.width && b.left < a.left + a.width && a.top < b.top + b.height && b.top < a.top + a.height;
}

function contains(area: Box, box: Box): boolean {
  return (
    box.left >= area.left &&
    box.top >= area.top &&
    box.left + box.width <= area.left + area.width &&
    box.top + box.height <= area.top + area.height
  );
}

/** Whether a segment touches a box (clipping by Liang and Barsky, 1984). */
export function crosses(box: Box, [x0, y0]: Point, [x1, y1]: Point): boolean {
  let [begin, end] = [0, 1];
  const limits: [number, number][] = [
    [x0 - x1, x0 - box.left],
    [x1 - x0, box.left + box.width - x0],
    [y0 - y1, y0 - box.top],
    [y1 - y0, box.top + box.height - y0],
  ];
  for (const [step, room] of limits) {
    if (step === 0 && room < 0) return false;
    if (step < 0) begin = Math.max(begin, room / step);
    if (step > 0) end = Math.min(end, room / step);
  }
  return begin <= end;
}

/** Where an extent begins whose near end is at the distance; in the middle across the direction. */
function beginning(at: number, share: number, distance: number, extent: number): number {
  if (Math.abs(share) < 0.1) return at - extent / 2;
  return share > 0 ? at + share * distance : at + share * distance - extent;
}

function box_at([x, y]: Point, [right, down]: Point, distance: number, [width, height]: Point): Box {
  return { left: beginning(x, right, distance, width), top: beginning(y, down, distance, height), width, height };
}

/** @returns a place for each point, null where none is free */
export function place_labels(
  points: Point[],
  sizes: Point[],
  area: Box,
  lines: [Point, Point][],
): (LabelPlace | null)[] {
  const taken: Box[] = points.map(([x, y]) => ({
    left: x - kPointRadius,
    top: y - kPointRadius,
    width: 2 * kPointRadius,
    height: 2 * kPointRadius,
  }));
  return points.map((point, index) => {
    let best: LabelPlace | null = null;
    let least = Infinity;
    kDistances.forEach((distance, ring) => {
      kDirections.forEach((direction, turn) => {
        const box = box_at(point, direction, distance, sizes[index]);
        if (!contains(area, box) || taken.some((other) => overlap(box, other))) return;
        const crossed = lines.filter(([from, to]) => crosses(box, from, to)).length;
        const near = { ...box, left: box.left - kDoubtRadius, width: box.width + 2 * kDoubtRadius };
        const doubtful = points.filter((other, i) => i !== index && crosses(near, other, other)).length;
        const middle: Point = [box.left + box.width / 2, box.top + box.height / 2];
        const hit = ring === 0 ? 0 : taken.filter((other, i) => i !== index && crosses(other, point, middle)).length;
        const cost = distance + turn + kLineCost * crossed + kDoubtCost * doubtful + kLeaderCost * hit;
        if (cost < least) [best, least] = [{ ...box, is_far: ring > 0 }, cost];
      });
    });
    if (best) taken.push(best);
    return best;
  });
}
