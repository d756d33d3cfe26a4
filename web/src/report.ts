import "./report.css";
import { add_angle_button, is_angle } from "./angles";
import { read_report, slice } from "./document";
import type { Figure, Report } from "./document";
import { StoredSamples } from "./sample_source";
import { make_rows_open, make_sortable } from "./sortable_table";
import { add_theme_button } from "./theme";
import { TimeView } from "./time_figure";
import { XyView } from "./xy_figure";

function draw(report: Report, figure: Figure, place: HTMLElement): void {
  if (figure.kind === "time") new TimeView(place, figure, (series) => new StoredSamples(report, figure, series));
  else new XyView(place, figure, (numbers) => slice(report, numbers));
}

/** Figures are drawn when they come near the screen: the page opens at once. */
function draw_when_near(report: Report): void {
  const waiting = new Map<Element, Figure>();
  const draw_now = (place: Element) => {
    const figure = waiting.get(place);
    if (!figure) return;
    waiting.delete(place);
    draw(report, figure, place as HTMLElement);
  };
  const near = new IntersectionObserver(
    (entries) => {
      for (const entry of entries)
        if (entry.isIntersecting) {
          near.unobserve(entry.target);
          draw_now(entry.target);
        }
    },
    { rootMargin: "600px" },
  );
  for (const figure of report.figures) {
    const place = document.getElementById(figure.id);
    if (!place) continue;
    waiting.set(place, figure);
    near.observe(place);
  }
  addEventListener("beforeprint", () => [...waiting.keys()].forEach(draw_now));
}

function has_angles(figure: Figure): boolean {
  if (figure.kind === "time") return figure.panels.some((panel) => is_angle(panel.label));
  return is_angle(figure.x.label) || is_angle(figure.y.label);
}

document.documentElement.classList.add("with-script");
const report = read_report();
if (report.figures.some(has_angles)) add_angle_button();
add_theme_button();
document.querySelectorAll("table").forEach((table) => {
  make_rows_open(table);
  make_sortable(table);
});
draw_when_near(report);
