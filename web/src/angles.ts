// Angles of the figures in degrees or radians: the numbers of a page are in radians.

const kDegrees = 180 / Math.PI;
const kUnit = /\[rad(\/s2?)?\]/;
/** The unit at the end of a channel's name, but not that of a stiffness or a damping. */
const kSuffix = /(?<!_(?:Nm|Nms|A|As))_rad(?=$|_s2?\b|[^a-z0-9_])/g;

let is_degrees = true;
const changed: (() => void)[] = [];

/** Calls a function after each change of the unit. */
export function on_angle_unit(redraw: () => void): void {
  changed.push(redraw);
}

export function is_angle(label: string): boolean {
  return kUnit.test(label);
}

/** Factor of the values of an axis with this label. */
export function angle_factor(label: string): number {
  return is_degrees && is_angle(label) ? kDegrees : 1;
}

/** The name of a channel of an axis with angles in the present unit. */
export function angle_channel(name: string): string {
  return is_degrees ? name.replace(kSuffix, "_deg") : name;
}

/** A label of an axis in the present unit; one without a unit of angles stays as it is. */
export function angle_text(label: string): string {
  return is_degrees && is_angle(label) ? angle_channel(label.replace(kUnit, "[deg$1]")) : label;
}

export function scaled(values: Float32Array, factor: number): Float32Array {
  return factor === 1 ? values : values.map((value) => factor * value);
}

/** The switch of a page with angles. */
export function add_angle_button(): void {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "angles";
  const update = () => (button.textContent = is_degrees ? "Angles in radians" : "Angles in degrees");
  button.addEventListener("click", () => {
    is_degrees = !is_degrees;
    update();
    changed.forEach((redraw) => redraw());
  });
  document.querySelector("header")?.append(button);
  update();
}
