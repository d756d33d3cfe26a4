// One joint of the live page: its figures, what it reports, and its models.
import type { TimeFigure, TimeSeries, XyFigure, XySeries } from "./document";
import type { LiveJoint, Status } from "./live_messages";
import { LiveSamples } from "./live_samples";
import { TimeView } from "./time_figure";
import { XyView } from "./xy_figure";

/** Longest range of time that a figure can show. */
const kKept_s = 60;
const kAnswer_ms = 1000;
const kLoopPoints = 600;
const kDeflection = "spring_deflection_rad";

/** A torque that is estimated: the joint's own, and one for each model of the page. */
interface Estimate {
  label: string;
  value: string;
  std_dev: string;
}

type Row = Float32Array;
/** A channel that is computed from others. */
interface Derived {
  name: string;
  from: [string, string];
  of: (a: number, b: number) => number;
}

function unit_of(channel: string): string {
  const words = channel.split("_");
  // "rad_s": the last word alone is not the unit.
  const unit = words.slice(-2).join("_");
  return /^(rad|Nm|Nms|As|1)_(s|rad)2?$/.test(unit) ? unit.replace("_", "/") : words[words.length - 1];
}

const kNothing: [number, number] = [0, 0];
function time_series(label: string, role: TimeSeries["role"], shown = true): TimeSeries {
  return { label, role, shown, overview: kNothing, detail: kNothing };
}

export class LiveJointView {
  readonly samples: LiveSamples;
  private readonly derived: Derived[] = [];
  private readonly estimates: Estimate[] = [];
  private readonly figures: TimeView[] = [];
  private readonly loop: XyView | null;
  private readonly state = document.createElement("p");
  private readonly toggles: HTMLInputElement[] = [];
  /** Until then what a person has chosen holds, since an older status may still arrive. */
  private readonly chosen_until_ms: number[] = [];
  private is_near = true;

  /** @param reference channel of the torque that was measured; null: there is none */
  constructor(
    private readonly place: HTMLElement,
    private readonly joint: LiveJoint,
    rate_Hz: number,
    private readonly reference: string | null,
    switch_model: (model: number, on: boolean) => void,
  ) {
    this.find_estimates();
    this.derive();
    this.samples = new LiveSamples([...joint.channels, ...this.derived.map(({ name }) => name)], rate_Hz, kKept_s);
    const heading = document.createElement("h2");
    heading.textContent = `Joint ${joint.id}: ${joint.name}, ${joint.actuator}`;
    this.state.className = "state";
    place.append(heading, this.state);
    this.add_models(place, switch_model);
    if (this.torque_figure(rate_Hz).panels.length > 0) this.add_time_view(place, this.torque_figure(rate_Hz));
    this.loop = this.add_loop(place);
    this.add_time_view(place, this.all_channels(rate_Hz));
    new IntersectionObserver(
      (entries) => (this.is_near = entries[entries.length - 1].isIntersecting),
      { rootMargin: "100px" },
    ).observe(place);
  }

  private find_estimates(): void {
    const has = (name: string) => this.joint.channels.includes(name);
    if (has("torque_Nm") && this.reference !== "torque_Nm")
      this.estimates.push({ label: "estimate of the joint", value: "torque_Nm", std_dev: "torque_std_dev_Nm" });
    for (const { name, target } of this.joint.models)
      if (target === "torque_Nm")
        this.estimates.push({ label: name, value: `${name}: estimate`, std_dev: `${name}: standard deviation` });
  }

  private derive(): void {
    const { channels } = this.joint;
    const add = (name: string, from: [string, string], of: Derived["of"]) => {
      if (from.every((each) => channels.includes(each)) && !channels.includes(name))
        this.derived.push({ name, from, of });
    };
    add(kDeflection, ["gear_angle_rad", "joint_angle_rad"], (gear, joint) => gear - joint);
    for (const { label, value, std_dev } of this.estimates) {
      add(`${label} lower bound`, [value, std_dev], (a, b) => a - b);
      add(`${label} upper bound`, [value, std_dev], (a, b) => a + b);
      if (this.reference) add(`${label} residual`, [value, this.reference], (a, b) => a - b);
    }
  }

  /** Telemetry of the joint, one channel after the other. */
  add(first: number, count: number, values: Float32Array): void {
    const { channels } = this.joint;
    const row = (name: string): Row => {
      const at = channels.indexOf(name) * count;
      return values.subarray(at, at + count);
    };
    const all = new Float32Array((channels.length + this.derived.length) * count);
    all.set(values);
    this.derived.forEach(({ from, of }, k) => {
      const [a, b] = from.map(row);
      const at = (channels.length + k) * count;
      for (let i = 0; i < count; ++i) all[at + i] = of(a[i], b[i]);
    });
    this.samples.add(first, count, all);
  }

  show_status(status: Status["joints"][number]): void {
    const words = [
      status.silent ? "no telemetry arrives" : `state ${status.state}`,
      ...(status.monitor ? [`monitor ${status.monitor}`] : []),
      ...(status.lost > 0 ? [`${status.lost} samples were lost`] : []),
    ];
    this.state.textContent = words.join("; ");
    this.state.classList.toggle("warning", status.silent);
    status.models.forEach((on, i) => {
      if (performance.now() > this.chosen_until_ms[i]) this.toggles[i].checked = on;
    });
    this.place.dataset.models = status.models.join(" ");
  }

  /** Draws the last `width_s`, if the joint is on or near the screen. */
  draw(width_s: number): void {
    if (!this.is_near) return;
    const end = this.samples.end_s;
    for (const figure of this.figures) figure.show_now(end - width_s, end);
    this.draw_loop(end - width_s, end);
  }

  private add_models(place: HTMLElement, switch_model: (model: number, on: boolean) => void): void {
    if (this.joint.models.length === 0) return;
    const group = document.createElement("fieldset");
    group.append(Object.assign(document.createElement("legend"), { textContent: "models" }));
    this.joint.models.forEach(({ name, on }, i) => {
      const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: on });
      box.addEventListener("change", () => {
        this.chosen_until_ms[i] = performance.now() + kAnswer_ms;
        switch_model(i, box.checked);
      });
      this.chosen_until_ms.push(0);
      const label = document.createElement("label");
      label.append(box, ` ${name}`);
      group.append(label);
      this.toggles.push(box);
    });
    place.append(group);
  }

  private torque_figure(rate_Hz: number): TimeFigure {
    const has = (name: string) => this.samples.has(name);
    const torque: TimeSeries[] = this.reference ? [time_series(this.reference, "measured")] : [];
    const residual: TimeSeries[] = [];
    for (const { label } of this.estimates) {
      torque.push(time_series(label, "model"));
      if (has(`${label} upper bound`))
        torque.push(time_series(`${label} lower bound`, "lower"), time_series(`${label} upper bound`, "upper"));
      if (has(`${label} residual`)) residual.push(time_series(`${label} residual`, "model"));
    }
    const panels = [
      { label: "torque [Nm]", series: torque },
      { label: "residual [Nm]", series: residual },
    ];
    return this.figure("torque", "Torque and its estimates", rate_Hz, panels);
  }

  /** All channels, those of one unit in one panel. */
  private all_channels(rate_Hz: number): TimeFigure {
    const panels = new Map<string, TimeSeries[]>();
    for (const channel of this.joint.channels) {
      if (channel.includes(": ")) continue; // of a model
      const unit = unit_of(channel);
      panels.set(unit, [...(panels.get(unit) ?? []), time_series(channel, "model")]);
    }
    const made = [...panels].map(([unit, series]) => ({ label: `[${unit}]`, series }));
    return { ...this.figure("all", "All channels", rate_Hz, made), compact: true };
  }

  private figure(id: string, title: string, rate_Hz: number, panels: TimeFigure["panels"]): TimeFigure {
    return {
      kind: "time",
      id: `${id}-${this.joint.id}`,
      title,
      start_s: 0,
      rate_Hz,
      samples: 0,
      bucket: 1,
      windows: [],
      marks: [],
      live: true,
      panels: panels.filter(({ series }) => series.length > 0),
    };
  }

  private place_for(place: HTMLElement, title: string): HTMLElement {
    const figure = document.createElement("figure");
    figure.append(Object.assign(document.createElement("figcaption"), { textContent: title }));
    const inner = document.createElement("div");
    figure.append(inner);
    place.append(figure);
    return inner;
  }

  private add_time_view(place: HTMLElement, figure: TimeFigure): void {
    const channel_of = (label: string) => this.estimates.find((each) => each.label === label)?.value ?? label;
    const source_of = (series: TimeSeries[]) => this.samples.source(series.map(({ label }) => channel_of(label)));
    this.figures.push(new TimeView(this.place_for(place, figure.title), figure, source_of));
  }

  private add_loop(place: HTMLElement): XyView | null {
    if (!this.samples.has(kDeflection)) return null;
    const series = (label: string, role: XySeries["role"]): XySeries =>
      ({ label, style: "line", role, shown: true, x: kNothing, y: kNothing });
    const shown = [
      ...(this.reference ? [series(this.reference, "measured")] : []),
      ...this.estimates.map(({ label }) => series(label, "model")),
    ];
    if (shown.length === 0) return null;
    const figure: XyFigure = {
      kind: "xy",
      id: `loop-${this.joint.id}`,
      title: "Hysteresis loop",
      x: { label: "deflection of the spring [rad]", log: false },
      y: { label: "torque [Nm]", log: false },
      equal: false,
      series: shown,
    };
    return new XyView(this.place_for(place, figure.title), figure, () => new Float32Array());
  }

  private draw_loop(begin_s: number, end_s: number): void {
    if (!this.loop) return;
    const names = [kDeflection, ...(this.reference ? [this.reference] : []), ...this.estimates.map(({ value }) => value)];
    const step = Math.max(Math.ceil(((end_s - begin_s) * this.samples.rate_Hz) / kLoopPoints), 1);
    const [x, ...y] = this.samples.every(step, names, begin_s, end_s);
    this.loop.replace(y.map((values) => [x, values]));
  }
}
