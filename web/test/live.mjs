// node live.mjs URL SECONDS: opens the page of `torsio connect page` in headless Chromium and uses it as a person does. Prints
// JSON with the pictures of each second. CHROMIUM: the browser's program.
import { chromium } from "playwright-core";

const [url, seconds] = process.argv.slice(2);
const problems = [];
function expect(condition, what) {
  if (!condition) problems.push(what);
}

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu"],
});
const context = await browser.newContext({ viewport: { width: 1600, height: 1200 } });
const page = await context.newPage();
const errors = [];
page.on("pageerror", (error) => errors.push(String(error)));
page.on("console", (message) => {
  if (message.type() === "error") errors.push(message.text());
});
await page.goto(url);
await page.waitForFunction(() => document.getElementById("connection").textContent.startsWith("Connected"), null, { timeout: 5000 });
const joints = await page.locator("section").count();
expect(joints > 0, "no joint is shown");

// Figures move.
const range = async () => (await page.locator(".canvas[data-range]").first().getAttribute("data-range")).split(" ").map(Number);
await page.waitForTimeout(1500);
const before = await range();
await page.waitForTimeout(1000);
const after = await range();
expect(after[1] > before[1] + 0.5, `the time series did not move on: ${before} to ${after}`);
const loop = page.locator("figure:has(svg) path.curve").first();
expect((await loop.count()) === 1 && (await loop.getAttribute("d")).length > 50, "no hysteresis loop is drawn");

// Models are turned off and on.
const model = page.locator("fieldset input").first();
if ((await model.count()) > 0) {
  const has_estimate = () =>
    page.evaluate(() => document.querySelector("section").dataset.models);
  await model.uncheck();
  await page.waitForFunction(() => document.querySelector("section").dataset.models?.startsWith("false"));
  await model.check();
  await page.waitForFunction(() => document.querySelector("section").dataset.models?.startsWith("true"));
  expect((await has_estimate()).startsWith("true"), "a model is not turned on again");
}

// The picture is held and goes on.
await page.getByRole("button", { name: "Hold the picture" }).click();
const held = await range();
await page.waitForTimeout(500);
expect((await range())[1] === held[1], "the picture is not held");
await page.getByRole("button", { name: "Hold the picture" }).click();

// A second page is refused, with the reason.
const second = await context.newPage();
await second.goto(url);
await second.waitForFunction(() => document.getElementById("connection").textContent.startsWith("Not connected"));
const reason = await second.locator("#connection").textContent();
expect(reason.includes("another page"), `a second page is told: ${reason}`);
await second.close();

// A recording, during which the page is busy for a second.
await page.getByRole("button", { name: "Record" }).click();
await page.getByRole("button", { name: "End the recording" }).waitFor();
await page.evaluate(() => {
  const end = performance.now() + 1000;
  while (performance.now() < end);
});
await page.waitForTimeout(1500);
await page.getByRole("button", { name: "End the recording" }).click();
await page.getByRole("button", { name: "Record", exact: true }).waitFor();

const pictures = [];
for (let second_of = 0; second_of < Number(seconds); ++second_of) {
  await page.waitForTimeout(1000);
  pictures.push(Number(await page.evaluate(() => document.body.dataset.pictures)));
}
expect(errors.length === 0, `errors of the page: ${errors.join("; ")}`);
const panels = await page.locator(".uplot").count();
const seen = await page.evaluate(
  () => [...document.querySelectorAll(".uplot")].filter((each) => {
    const { top, bottom } = each.getBoundingClientRect();
    return bottom > 0 && top < innerHeight;
  }).length,
);
console.log(JSON.stringify({ joints, panels, seen, pictures, problems }));
await browser.close();
process.exit(problems.length > 0 ? 1 : 0);
