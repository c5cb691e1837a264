// Bundles main.js and all that it imports into ../page.bundle.js, with the licences of what is kept in it on top.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync } from "node:fs";
import { build } from "esbuild";

const here = new URL("./", import.meta.url);
const read = (name) => readFileSync(new URL(name, here), "utf8");
// What a test compares: a bundle is as new as these files.
const sources = [...readdirSync(here).filter((name) => name.endsWith(".js")), "package-lock.json"].sort();
const digest = createHash("sha256");
for (const name of sources) digest.update(`${name}\n${read(name)}`);

await build({
  absWorkingDir: here.pathname,
  entryPoints: ["main.js"],
  outfile: "../page.bundle.js",
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2023",
  legalComments: "none",
  charset: "ascii",
  banner: { js: `/* sources sha256 ${digest.digest("hex")}\n\n${read("../page.LICENSES.txt")}*/` },
});
