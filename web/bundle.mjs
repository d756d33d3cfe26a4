// node bundle.mjs FOLDER: writes report.js, report.css, live.js, live.css and live.html from src/ into the folder.
import { copyFileSync } from "node:fs";
import { join } from "node:path";
import { build } from "esbuild";

const web = import.meta.dirname ?? new URL(".", import.meta.url).pathname;
await build({
  absWorkingDir: web,
  entryPoints: ["src/report.ts", "src/live.ts"],
  outdir: process.argv[2],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2020",
  charset: "utf8",
  legalComments: "none",
});
copyFileSync(join(web, "src/live.html"), join(process.argv[2], "live.html"));
