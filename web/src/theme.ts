// Light and dark: the system's choice until the button is pressed. Colours are CSS variables (report.css).

const changed: (() => void)[] = [];

/** Calls a function after each change of the colours. */
export function on_theme(redraw: () => void): void {
  changed.push(redraw);
}

/** Of the present theme: the style of the page is asked once for each colour, not at each drawing. */
const colours = new Map<string, string>();
export function css_colour(name: string): string {
  let colour = colours.get(name);
  if (colour === undefined) {
    colour = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    colours.set(name, colour);
  }
  return colour;
}

function redraw_all(): void {
  colours.clear();
  changed.forEach((redraw) => redraw());
}

const kColours = 8;

/** Colours of Okabe and Ito, which colour-blind people tell apart; darker on white. */
export function series_colour(role: string, index: number): string {
  return role === "measured" ? "--text" : role === "limit" ? "--limit" : `--series-${index % kColours}`;
}

/** From the ninth series on lines are dashed. */
export function series_dash(index: number): number[] {
  return [[], [6, 3], [2, 3], [8, 3, 2, 3]][Math.floor(index / kColours) % 4];
}

/** Colours of a scale from 0 to 1 (cividis), which are told apart in both themes. */
const kScale = ["#35528b", "#5d6e7f", "#7f8578", "#aa9a63", "#d9b93f"];
export function scale_colour(share: number): string {
  return kScale[Math.min(Math.floor(share * kScale.length), kScale.length - 1)];
}

function is_dark(): boolean {
  const chosen = document.documentElement.dataset.theme;
  return chosen ? chosen === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}

export function add_theme_button(): void {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "theme";
  const update = () => {
    button.textContent = is_dark() ? "Light colours" : "Dark colours";
    redraw_all();
  };
  button.addEventListener("click", () => {
    document.documentElement.dataset.theme = is_dark() ? "light" : "dark";
    update();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", update);
  let before_printing: string | undefined;
  addEventListener("beforeprint", () => {
    before_printing = document.documentElement.dataset.theme;
    document.documentElement.dataset.theme = "light";
    update();
  });
  addEventListener("afterprint", () => {
    if (before_printing) document.documentElement.dataset.theme = before_printing;
    else delete document.documentElement.dataset.theme;
    update();
  });
  document.querySelector("header")?.append(button);
  update();
}
