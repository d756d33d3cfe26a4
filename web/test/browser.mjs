// node browser.mjs REPORTS [--pictures FOLDER] [--compare FOLDER --differences FOLDER]: opens every report of a folder in
// headless Chromium and uses it as a person does, in both themes. --pictures writes a picture of each theme; --compare
// compares them with those of a folder and writes what differs. CHROMIUM: the browser's program.
import { readdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { parseArgs } from "node:util";
import { chromium } from "playwright-core";
import { check_angles, check_frame_rate, check_names, check_nothing_is_cut } from "./page_checks.mjs";
import { compare_pictures, take_picture } from "./pictures.mjs";

const { positionals, values: options } = parseArgs({
  allowPositionals: true,
  options: { pictures: { type: "string" }, compare: { type: "string" }, differences: { type: "string" } },
});
const [reports] = positionals;
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const kMaxMilliseconds = 1500;
const problems = [];

function expect(condition, what) {
  if (!condition) problems.push(what);
}

async function check_time_figure(page, name) {
  const canvas = page.locator(".canvas[data-range]").first();
  if ((await canvas.count()) === 0) return;
  await canvas.scrollIntoViewIfNeeded();
  const range = async () => (await canvas.getAttribute("data-range")).split(" ").map(Number);
  const all = await range();
  await canvas.focus();
  await page.keyboard.press("+");
  await page.waitForTimeout(60);
  const near = await range();
  expect(near[1] - near[0] < 0.8 * (all[1] - all[0]), `${name}: the key + does not zoom the time series`);
  await page.keyboard.press("ArrowRight");
  await page.waitForTimeout(60);
  expect((await range())[0] > near[0], `${name}: the right arrow does not move the time series`);
  await page.keyboard.press("0");
  await page.waitForTimeout(60);
  expect((await range())[0] === all[0], `${name}: the key 0 does not show the whole time series`);
  const plot = canvas.locator(".u-over").first();
  await plot.scrollIntoViewIfNeeded();
  const box = await plot.boundingBox();
  await page.mouse.move(box.x + 0.3 * box.width, box.y + 40);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.5 * box.width, box.y + 60, { steps: 4 });
  await page.mouse.up();
  await page.waitForTimeout(60);
  const dragged = await range();
  expect(dragged[1] - dragged[0] < 0.3 * (all[1] - all[0]), `${name}: dragging does not zoom the time series`);
  await page.keyboard.press("0");
}

async function check_xy_figure(page, name) {
  const figure = page.locator("figure:has(.canvas > svg)").first();
  if ((await figure.count()) === 0) return;
  const svg = figure.locator(".canvas > svg");
  await figure.scrollIntoViewIfNeeded();
  const ticks = () => svg.locator("text.tick").allTextContents();
  const before = await ticks();
  await figure.getByRole("button", { name: "Zoom in" }).click();
  await page.waitForTimeout(60);
  expect(String(await ticks()) !== String(before), `${name}: Zoom in does not change the axes`);
  await figure.getByRole("button", { name: "Show all" }).click();
  expect(String(await ticks()) === String(before), `${name}: Show all does not restore the axes`);
  const series = figure.locator(".legend input").first();
  if ((await series.count()) === 0) return;
  const curves = () => svg.locator("path.curve, path.dots, rect.column").count();
  const shown = await curves();
  const was_checked = await series.isChecked();
  await series.focus();
  await page.keyboard.press("Space");
  expect((await curves()) !== shown, `${name}: a box of the legend does not hide its series`);
  expect((await series.isChecked()) !== was_checked, `${name}: a box of the legend stays as it is`);
  await page.keyboard.press("Space");
  expect((await curves()) === shown, `${name}: a box of the legend does not show its series again`);
  const struck = await figure.locator(".legend *").evaluateAll(
    (parts) => parts.filter((part) => getComputedStyle(part).textDecorationLine.includes("line-through")).length,
  );
  expect(struck === 0, `${name}: ${struck} entries of a legend are struck out`);
}

async function check_table(page, name) {
  const table = page.locator("table").first();
  const heading = table.locator("th").nth(1);
  const cells = () => table.locator("tbody > tr:first-child > td:nth-child(2)").allTextContents();
  await heading.getByRole("button").click();
  const rising = await cells();
  await heading.getByRole("button").click();
  const falling = await cells();
  const is_changed = new Set(rising).size < 2 || String(rising) !== String(falling);
  expect(is_changed, `${name}: a click on a heading does not sort`);
  const opener = page.locator(".open-row").first();
  if ((await opener.count()) === 0) return;
  await opener.click();
  expect((await opener.getAttribute("aria-expanded")) === "true", `${name}: a row does not open`);
  await opener.click();
}

/** Frames per second while the time series is moved. */
async function panning_rate(page) {
  return page.evaluate(async () => {
    const canvas = document.querySelector(".canvas[data-range]");
    if (!canvas) return null;
    canvas.scrollIntoView({ block: "start" });  // panels that cannot be seen are not drawn
    await new Promise((done) => setTimeout(done, 200));
    const press = (key) => canvas.dispatchEvent(new KeyboardEvent("keydown", { key }));
    for (let i = 0; i < 4; ++i) press("+");
    const start = performance.now();
    let frames = 0;
    while (frames < 60) {
      press(frames % 20 < 10 ? "ArrowRight" : "ArrowLeft");
      await new Promise((done) => requestAnimationFrame(done));
      ++frames;
    }
    press("0");
    return Math.round((1000 * frames) / (performance.now() - start));
  });
}

async function check_report(browser, file, theme) {
  const name = `${file} (${theme})`;
  const context = await browser.newContext({ colorScheme: theme, viewport: { width: 1280, height: 900 } });
  const page = await context.newPage();
  page.on("console", (message) => {
    if (message.type() === "error") problems.push(`${name}: console: ${message.text()}`);
  });
  page.on("pageerror", (error) => problems.push(`${name}: ${error.message}`));
  page.on("request", (request) => {
    if (!/^(file|data|blob):/.test(request.url())) problems.push(`${name}: asks for ${request.url()}`);
  });
  const start = performance.now();
  await page.goto("file://" + resolve(join(reports, file)));
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  const opened_ms = performance.now() - start;
  const picture = `${file.replace(".html", "")}-${theme}.png`;
  if (options.pictures) await take_picture(page, join(options.pictures, picture));
  if (options.compare)
    problems.push(...(await compare_pictures(page, join(options.compare, picture), join(options.differences, picture))));
  problems.push(...(await check_nothing_is_cut(page, name)));
  problems.push(...(await check_names(page, name)));
  problems.push(...(await check_angles(page, name)));
  await check_table(page, name);
  await check_xy_figure(page, name);
  await check_time_figure(page, name);
  const rate = await panning_rate(page);
  if (file === "compare.html") problems.push(...(await check_frame_rate(page, name)));
  await page.evaluate(() => scrollTo(0, 0));
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run());
  for (const { id, impact, nodes } of violations)
    if (impact === "serious" || impact === "critical" || id === "landmark-unique")
      problems.push(`${name}: axe ${id}: ${nodes[0].html}`);
  await page.getByRole("button", { name: theme === "dark" ? "Light colours" : "Dark colours" }).click();
  const chosen = await page.evaluate(() => document.documentElement.dataset.theme);
  expect(chosen !== theme, `${name}: the button does not change the colours`);
  const pdf = await page.pdf({ format: "A4" });
  expect(pdf.length > 10000, `${name}: printing gives no pages`);
  const narrow = await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
  expect(narrow, `${name}: the page is wider than the window`);
  await page.setViewportSize({ width: 380, height: 700 });
  await page.waitForTimeout(100);
  problems.push(...(await check_nothing_is_cut(page, `${name}, on a phone`, true)));
  const phone = await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth + 1);
  expect(phone, `${name}: the page is wider than a phone`);
  expect(opened_ms < kMaxMilliseconds, `${name}: opens in ${opened_ms.toFixed(0)} ms`);
  console.log(`${name}: opened in ${opened_ms.toFixed(0)} ms, ${rate ?? "-"} frames/s while moving`);
  await context.close();
}

async function check_without_script(browser, file) {
  const context = await browser.newContext({ javaScriptEnabled: false });
  const page = await context.newPage();
  await page.goto("file://" + resolve(join(reports, file)));
  expect((await page.locator("table tbody tr").count()) > 0, `${file}: no table without JavaScript`);
  await context.close();
}

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--font-render-hinting=none"],
});
for (const file of readdirSync(reports).filter((name) => name.endsWith(".html")).sort()) {
  for (const theme of ["light", "dark"]) await check_report(browser, file, theme);
  await check_without_script(browser, file);
}
await browser.close();
for (const problem of problems) console.error(problem);
process.exit(problems.length > 0 ? 1 : 0);
