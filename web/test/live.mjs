// node live.mjs TORSIO [JOINTS [SECONDS]]: opens the page of `torsio connect page` with simulated joints in headless Chromium and
// uses it as a person does. Prints the pictures of each second and the CPU time of the program. CHROMIUM: the browser's program.
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { chromium } from "playwright-core";

const torsio = resolve(process.argv[2]);
const joint_count = Number(process.argv[3] ?? 12);
const seconds = Number(process.argv[4] ?? 10);
const folder = mkdtempSync(join(tmpdir(), "torsio-page-"));
const line = ["--port", "37001", "--host-port", "37000"];
const kTicksPerSecond = 100; // of /proc/PID/stat
const problems = [];
function expect(condition, what) {
  if (!condition) problems.push(what);
}

function must(...command) {
  const done = spawnSync(torsio, command, { cwd: folder, encoding: "utf8" });
  if (done.status !== 0) throw new Error(`torsio ${command.join(" ")}\n${done.stderr}`);
}
must("simulate", "dfki-50", "sweep", "--duration", "20s", "--seed", "1", "-o", "sweep.csv");
must("fit", "sweep.csv", "--model", "linear_coulomb", "--inputs",
  "spring_deflection_rad, lowpass(rate(spring_deflection_rad), 10Hz)", "-o", "model.safetensors");
const joints_program = spawn(torsio, ["joint", ...Array(joint_count).fill("dfki-50"), ...line, "--watchdog", "1s"], { cwd: folder });
await new Promise((done) => setTimeout(done, 1500));
const page_program = spawn(
  torsio,
  ["connect", "page", "--joints", `1-${joint_count}`, ...line, "--model", "model.safetensors", "--json", "page.json"],
  { cwd: folder },
);
process.on("exit", () => {
  page_program.kill("SIGKILL");
  joints_program.kill("SIGKILL");
});
let printed = "";
page_program.stderr.on("data", (text) => (printed += text));
const url = await new Promise((found, failed) => {
  const deadline = setTimeout(() => failed(new Error(`no address was printed: ${printed}`)), 10_000);
  const look = setInterval(() => {
    const match = printed.match(/http:\S+/);
    if (!match) return;
    clearInterval(look);
    clearTimeout(deadline);
    found(match[0]);
  }, 20);
});
/** CPU time of the program in seconds. */
function cpu_s() {
  const fields = readFileSync(`/proc/${page_program.pid}/stat`, "utf8").split(") ")[1].split(" ");
  return (Number(fields[11]) + Number(fields[12])) / kTicksPerSecond;
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
expect(joints === joint_count, `${joints} joints are shown`);

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

// Pages of others.
const other = await context.newPage();
await other.goto(url.replace(/token=.*/, "token=wrong"));
await other.waitForFunction(() => document.getElementById("connection").textContent.startsWith("Not connected"));
await other.close();
await page.bringToFront();
await page.locator("figcaption", { hasText: "All channels" }).first().evaluate((caption) => caption.scrollIntoView());
await page.waitForTimeout(1500);

const pictures = [];
const begin_s = cpu_s();
for (let second_of = 0; second_of < seconds; ++second_of) {
  await page.waitForTimeout(1000);
  pictures.push(Number(await page.evaluate(() => document.body.dataset.pictures)));
}
const drawing_ms = await page.evaluate(() => document.body.dataset.drawing);
const cores = (cpu_s() - begin_s) / seconds;
const panels = await page.locator(".uplot").count();
const visible = await page.evaluate(
  () =>
    [...document.querySelectorAll(".uplot")].filter((each) => {
      const { top, bottom } = each.getBoundingClientRect();
      return bottom > 0 && top < innerHeight;
    }).length,
);
await browser.close();
page_program.kill("SIGINT");
await new Promise((done) => page_program.on("exit", done));
joints_program.kill("SIGINT");
const { joints: counts, dropped } = JSON.parse(readFileSync(join(folder, "page.json"), "utf8"));
const lost = counts.reduce((sum, joint) => sum + joint.lost, 0);
const recordings = printed.split("\n").filter((text) => text.includes("samples of"));
expect(recordings.length === joint_count, `${recordings.length} recordings were completed`);
// Errors of a WebSocket that is refused are those of the test.
const unexpected = errors.filter((text) => !text.includes("WebSocket"));
expect(unexpected.length === 0, `errors of the page: ${unexpected.join("; ")}`);
pictures.sort((a, b) => a - b);
console.log(`${joint_count} joints, ${panels} panels, ${visible} of them on the screen`);
console.log(`time of the script for a picture: ${drawing_ms} ms`);
console.log(`pictures in a second: ${pictures[0]} at least, ${pictures[Math.floor(pictures.length / 2)]} median`);
console.log(`CPU of torsio connect page: ${cores.toFixed(2)} cores; telemetry lost on the line: ${lost}; pages dropped: ${dropped}`);
console.log(recordings[0]);
for (const problem of problems) console.log(`FAILED: ${problem}`);
rmSync(folder, { recursive: true });
process.exit(problems.length > 0 ? 1 : 0);
