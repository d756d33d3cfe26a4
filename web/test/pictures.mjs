// Pictures of reports, and their comparison with stored ones.
import { existsSync, readFileSync, writeFileSync } from "node:fs";

const kPicture = { width: 900, height: 1500 };
/** A pixel differs by more than this in one of its colours (0 to 255): edges of letters differ less. */
const kPixelTolerance = 48;
/** Share of the pixels that may differ: what a font or a library draws in another place by a pixel. */
const kShareTolerance = 0.005;
/** Times that the machine measures differ from run to run: these columns and figures are not compared. */
const kMeasuredColumns = ["step ns", "p99.9", "fit s"];
const kMeasuredFigures = ["Error against the time of a step"];

/** Prepares the page; returns what is photographed: from its beginning to the end of the first time series or figure. */
async function arrange(page) {
  await page.setViewportSize(kPicture);
  await page.waitForTimeout(300); // figures are drawn when they come near the screen
  const end = await page.evaluate(() => {
    const figures = [...document.querySelectorAll("figure")];
    const last = figures.find((figure) => figure.querySelector(".uplot")) ?? figures[0];
    return last ? last.getBoundingClientRect().bottom : innerHeight;
  });
  return { x: 0, y: 0, width: kPicture.width, height: Math.min(Math.ceil(end) + 16, kPicture.height) };
}

async function photograph(page, use) {
  const size = page.viewportSize();
  const clip = await arrange(page);
  const bytes = await page.screenshot({ clip, animations: "disabled" });
  const result = await use(bytes);
  await page.setViewportSize(size);
  return result;
}

export async function take_picture(page, path) {
  await photograph(page, (bytes) => writeFileSync(path, bytes));
}

/** Boxes of the page whose content is measured at each run. */
async function measured_boxes(page) {
  return page.evaluate(
    ([columns, figures]) => {
      const parts = [];
      for (const table of document.querySelectorAll("table"))
        [...table.tHead.rows[0].cells].forEach((heading, column) => {
          if (columns.includes(heading.textContent.trim()))
            for (const body of table.tBodies) parts.push(body.rows[0].cells[column]);
        });
      for (const figure of document.querySelectorAll("figure"))
        if (figures.includes(figure.querySelector("figcaption").textContent)) parts.push(figure);
      return parts.map((part) => {
        const { left, top, width, height } = part.getBoundingClientRect();
        return { left, top: top + scrollY, width, height };
      });
    },
    [kMeasuredColumns, kMeasuredFigures],
  );
}

/** In the browser, which reads PNG. @returns the share of pixels that differ, and a picture with these in red */
function difference([stored_bytes, new_bytes, ignored, tolerance]) {
  const pixels_of = async (bytes) => {
    const image = new Image();
    image.src = `data:image/png;base64,${bytes}`;
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(image, 0, 0);
    return { canvas, context, data: context.getImageData(0, 0, image.width, image.height) };
  };
  return Promise.all([pixels_of(stored_bytes), pixels_of(new_bytes)]).then(([stored, now]) => {
    const sizes = [stored, now].map(({ canvas }) => `${canvas.width} x ${canvas.height}`);
    if (sizes[0] !== sizes[1]) return { sizes };
    const { width, height } = now.canvas;
    const is_ignored = (x, y) =>
      ignored.some((box) => x >= box.left && x < box.left + box.width && y >= box.top && y < box.top + box.height);
    let differing = 0;
    for (let y = 0; y < height; ++y)
      for (let x = 0; x < width; ++x) {
        const at = 4 * (y * width + x);
        const [a, b] = [stored.data.data, now.data.data];
        const largest = Math.max(...[0, 1, 2].map((k) => Math.abs(a[at + k] - b[at + k])));
        if (largest <= tolerance || is_ignored(x, y)) continue;
        ++differing;
        [b[at], b[at + 1], b[at + 2]] = [255, 0, 0];
      }
    now.context.putImageData(now.data, 0, 0);
    return { share: differing / (width * height), picture: now.canvas.toDataURL("image/png").split(",")[1] };
  });
}

/** Compares the page with a stored picture; where they differ a picture with the differing pixels in red is written. */
export async function compare_pictures(page, stored, differences) {
  if (!existsSync(stored)) return [`${stored} is missing: tools/test_reports --pictures writes it`];
  return photograph(page, async (bytes) => {
    const ignored = await measured_boxes(page);
    const input = [readFileSync(stored).toString("base64"), bytes.toString("base64"), ignored, kPixelTolerance];
    const { sizes, share, picture } = await page.evaluate(difference, input);
    const advice = "look at it, and if it is right write the pictures again with tools/test_reports --pictures";
    if (sizes) {
      writeFileSync(differences, bytes);
      return [`${stored} is ${sizes[0]}, the page ${sizes[1]} (${differences}): ${advice}`];
    }
    if (share <= kShareTolerance) return [];
    writeFileSync(differences, Buffer.from(picture, "base64"));
    const percent = (value) => `${(100 * value).toFixed(2)} %`;
    return [
      `${stored}: ${percent(share)} of the pixels differ by more than ${kPixelTolerance} of 255, at most ` +
        `${percent(kShareTolerance)} are expected (${differences}): ${advice}`,
    ];
  });
}
