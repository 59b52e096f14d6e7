// Writes the page into the package, where the wheel takes it from.
import { copyFileSync, mkdirSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = (name) => fileURLToPath(new URL(name, import.meta.url));
const page = here("../src/upright/browser/page/");
mkdirSync(page, { recursive: true });
await build({
  entryPoints: { bench: here("src/main.ts"), worker: here("src/worker.ts") },
  outdir: page, bundle: true, minify: true, format: "iife", target: "es2022", charset: "utf8", legalComments: "none",
});
await build({ entryPoints: [here("src/bench.css")], outdir: page, minify: true, charset: "utf8" });
copyFileSync(here("src/index.html"), `${page}index.html`);
