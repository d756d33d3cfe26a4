// Checks of a report's page in a browser. Each returns a list of problems.

/** Every figure is drawn, also below the screen. */
async function draw_all(page) {
  await page.evaluate(async () => {
    for (const figure of document.querySelectorAll("figure")) {
      figure.scrollIntoView();
      await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    }
    scrollTo(0, 0);
  });
  await page.waitForTimeout(300);
}

/**
 * Texts are within what shows them: no table and no text is wider than its box, unless `may_scroll` and the box scrolls,
 * and no text of a figure reaches over its border.
 */
export async function check_nothing_is_cut(page, name, may_scroll = false) {
  await draw_all(page);
  const cut = await page.evaluate((can_scroll) => {
    const found = [];
    for (const box of document.querySelectorAll(".scroll, pre, p, h1, h2, figcaption, .legend, .toolbar, td, th")) {
      if (box.clientWidth === 0 || box.scrollWidth <= box.clientWidth + 1) continue;
      const scrolls = ["auto", "scroll"].includes(getComputedStyle(box).overflowX);
      if (!(can_scroll && scrolls)) found.push(`${box.tagName} '${box.textContent.trim().slice(0, 60)}'`);
    }
    for (const svg of document.querySelectorAll(".canvas > svg")) {
      const border = svg.getBoundingClientRect();
      for (const text of svg.querySelectorAll("text")) {
        const { left, right, top, bottom } = text.getBoundingClientRect();
        const is_within =
          left >= border.left - 1 && right <= border.right + 1 && top >= border.top - 1 && bottom <= border.bottom + 1;
        if (!is_within) found.push(`'${text.textContent}' in '${svg.getAttribute("aria-label")}'`);
      }
    }
    return found;
  }, may_scroll);
  return cut.map((what) => `${name}: ${what} is cut`);
}

/** The texts of a figure are not over each other, and each logarithmic axis has at least three numbers. */
export async function check_names(page, name) {
  const found = await page.evaluate(() => {
    const problems = [];
    for (const svg of document.querySelectorAll(".canvas > svg")) {
      const texts = [...svg.querySelectorAll("text")].map((text) => ({
        text: text.textContent,
        box: text.getBoundingClientRect(),
      }));
      texts.forEach((a, i) => {
        for (const b of texts.slice(i + 1)) {
          const across = Math.min(a.box.right, b.box.right) - Math.max(a.box.left, b.box.left);
          const down = Math.min(a.box.bottom, b.box.bottom) - Math.max(a.box.top, b.box.top);
          if (across > 1 && down > 3)
            problems.push(`'${a.text}' and '${b.text}' overlap in '${svg.getAttribute("aria-label")}'`);
        }
      });
    }
    const cost = [...document.querySelectorAll(".canvas > svg")].find((svg) =>
      svg.getAttribute("aria-label").startsWith("Error against the time"),
    );
    if (cost) {
      const names = JSON.parse(document.getElementById("report-figures").textContent)
        .find((figure) => figure.title.startsWith("Error against the time"))
        .series.flatMap((series) => series.names ?? []);
      const written = [...cost.querySelectorAll("text")].map((text) => text.textContent);
      for (const name of names) if (!written.includes(name)) problems.push(`${name} has no name in the cost figure`);
      const ends = [...cost.querySelectorAll("text.end")].length;
      if (ends < 3) problems.push(`the axis of the errors has ${ends} numbers`);
    }
    return problems;
  });
  return found.map((what) => `${name}: ${what}`);
}

/** The switch of the unit of angles multiplies the axis and changes its label, and back. */
export async function check_angles(page, name) {
  const figures = await page.evaluate(() =>
    JSON.parse(document.getElementById("report-figures").textContent).map(({ id, kind, x, y, panels }) => ({
      id,
      labels: kind === "xy" ? [x.label, y.label] : panels.map((panel) => panel.label),
      is_drawn: kind === "xy",
    })),
  );
  const with_angles = figures.filter(({ labels }) => labels.some((label) => /\[rad(\/s2?)?\]/.test(label)));
  const button = page.locator("header button.angles");
  const has_button = (await button.count()) === 1;
  if (has_button !== with_angles.length > 0)
    return [`${name}: ${with_angles.length} figures have angles, but the switch is ${has_button ? "there" : "missing"}`];
  const drawn = with_angles.find((figure) => figure.is_drawn);
  if (!drawn) return [];
  const texts = () => page.locator(`#${drawn.id} svg text`).allTextContents();
  const problems = [];
  const degrees = await texts();
  if (!degrees.some((text) => text.includes("[deg"))) problems.push(`${name}: angles are not in degrees at first`);
  await button.click();
  const radians = await texts();
  if (!radians.some((text) => text.includes("[rad"))) problems.push(`${name}: the switch does not change the label`);
  if (String(radians.filter(Number)) === String(degrees.filter(Number)))
    problems.push(`${name}: the switch does not change the numbers`);
  await button.click();
  if (String(await texts()) !== String(degrees)) problems.push(`${name}: the switch does not return to degrees`);
  return problems;
}

const kLeastFrames_Hz = 30;
const kAttempts = 3;

/** Frames per second while the loops and the time series of all models are zoomed and moved. */
export async function check_frame_rate(page, name) {
  const measure = () =>
    page.evaluate(async () => {
      const next = () => new Promise((done) => requestAnimationFrame(done));
      const rates = {};
      const show_all = async (figure) => {
        figure.scrollIntoView({ block: "start" });
        await new Promise((done) => setTimeout(done, 300));
        for (const box of figure.querySelectorAll(".legend input:not(:checked)")) box.click();
        await next();
        return figure.querySelectorAll(".legend input").length;
      };
      const figures = [...document.querySelectorAll("figure")];
      const caption = (figure) => figure.querySelector("figcaption").textContent;
      for (const start of ["torque_Nm over", "Time series"]) {
        const figure = figures.find((each) => caption(each).startsWith(start));
        const curves = await show_all(figure);
        const canvas = figure.querySelector(".canvas");
        const keys = ["+", "+", "+", "ArrowRight", "ArrowLeft", "ArrowLeft", "ArrowRight", "-", "-", "-"];
        const begin = performance.now();
        const kFrames = 60;
        for (let frame = 0; frame < kFrames; ++frame) {
          canvas.dispatchEvent(new KeyboardEvent("keydown", { key: keys[frame % keys.length] }));
          await next();
        }
        rates[caption(figure)] = { curves, rate: Math.round((1000 * kFrames) / (performance.now() - begin)) };
        canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "0" }));
        await next();
      }
      return rates;
    });
  // Other work of the machine makes an attempt slower, never faster.
  let best = await measure();
  for (let k = 1; k < kAttempts; ++k) {
    if (Object.values(best).every(({ rate }) => rate >= kLeastFrames_Hz)) break;
    const again = await measure();
    for (const [figure, { rate }] of Object.entries(again)) if (rate > best[figure].rate) best[figure].rate = rate;
  }
  const problems = [];
  for (const [figure, { curves, rate }] of Object.entries(best)) {
    console.log(`${name}: '${figure}' with ${curves} curves: ${rate} frames/s while zooming and moving`);
    if (rate < kLeastFrames_Hz) problems.push(`${name}: '${figure}' has ${rate} frames/s, at least ${kLeastFrames_Hz} are expected`);
  }
  return problems;
}
