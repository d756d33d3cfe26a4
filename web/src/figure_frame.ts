// What every figure has: a row of buttons, a legend that shows and hides series, keys and the wheel.

export interface View {
  zoom(factor: number): void;
  /** By shares of the width and of the height. */
  pan(right: number, up: number): void;
  reset(): void;
}

/** So long after the last event lines are drawn in their full width: those of one pixel are many times faster. */
export const kRest_ms = 200;

function add_button(row: HTMLElement, label: string, action: () => void): HTMLButtonElement {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = label;
  button.addEventListener("click", action);
  row.append(button);
  return button;
}

const kZoomStep = 1.5;
const kPanStep = 0.2;

export interface Frame {
  toolbar: HTMLElement;
  canvas: HTMLElement;
  note: HTMLElement;
  /** The names of what is shaded below the pointer; hidden where nothing is. */
  marks: HTMLElement;
}

/** The elements of a figure in the container that the page has for it. */
export function make_frame(place: HTMLElement, title: string): Frame {
  const toolbar = document.createElement("div");
  toolbar.className = "toolbar";
  const canvas = document.createElement("div");
  canvas.className = "canvas";
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "application");
  canvas.setAttribute("aria-label", `${title}: plus and minus zoom, arrow keys move, 0 shows everything`);
  const note = document.createElement("p");
  note.className = "note";
  note.setAttribute("role", "status");
  const marks = document.createElement("p");
  marks.className = "note marks";
  marks.hidden = true;
  place.replaceChildren(toolbar, canvas, note, marks);
  return { toolbar, canvas, note, marks };
}

export function add_controls(frame: Frame, view: View): void {
  add_button(frame.toolbar, "Zoom in", () => view.zoom(1 / kZoomStep));
  add_button(frame.toolbar, "Zoom out", () => view.zoom(kZoomStep));
  add_button(frame.toolbar, "Show all", () => view.reset());
  const actions: Record<string, () => void> = {
    "+": () => view.zoom(1 / kZoomStep),
    "=": () => view.zoom(1 / kZoomStep),
    "-": () => view.zoom(kZoomStep),
    "0": () => view.reset(),
    ArrowLeft: () => view.pan(-kPanStep, 0),
    ArrowRight: () => view.pan(kPanStep, 0),
    ArrowUp: () => view.pan(0, kPanStep),
    ArrowDown: () => view.pan(0, -kPanStep),
  };
  frame.canvas.addEventListener("keydown", (event) => {
    const action = actions[event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  });
  frame.canvas.addEventListener("dblclick", () => view.reset());
  // Without the control key the wheel scrolls the page.
  frame.canvas.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey && !event.shiftKey) return;
      event.preventDefault();
      if (event.shiftKey) view.pan(Math.sign(event.deltaY || event.deltaX) * kPanStep, 0);
      else view.zoom(event.deltaY > 0 ? kZoomStep : 1 / kZoomStep);
    },
    { passive: false },
  );
}

export interface LegendEntry {
  label: string;
  /** Name of a CSS variable. */
  colour: string;
  shown: boolean;
}

/** A box for each series, checked where the series is shown. @returns renames the entries */
export function add_legend(
  frame: Frame,
  entries: LegendEntry[],
  toggle: (index: number, shown: boolean) => void,
): (name_of: (label: string, index: number) => string) => void {
  const legend = document.createElement("div");
  legend.className = "legend";
  legend.setAttribute("role", "group");
  legend.setAttribute("aria-label", "series");
  const names = entries.map((entry, index) => {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = entry.shown;
    box.addEventListener("change", () => toggle(index, box.checked));
    const swatch = document.createElement("span");
    swatch.className = "swatch";
    swatch.style.background = `var(${entry.colour})`;
    const name = document.createElement("span");
    name.textContent = entry.label;
    label.append(box, swatch, name);
    legend.append(label);
    return name;
  });
  frame.toolbar.after(legend);
  return (name_of) => names.forEach((name, index) => (name.textContent = name_of(entries[index].label, index)));
}
