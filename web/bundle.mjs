// node bundle.mjs FOLDER: writes report.js and report.css from src/ into the folder.
import { build } from "esbuild";

await build({
  absWorkingDir: import.meta.dirname ?? new URL(".", import.meta.url).pathname,
  entryPoints: ["src/report.ts"],
  outfile: `${process.argv[2]}/report.js`,
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2020",
  charset: "utf8",
  legalComments: "none",
});
