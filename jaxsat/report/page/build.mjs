// Bundles main.js, search.js and sweep.js with all that they import into ../page.bundle.js, ../search.bundle.js and
// ../sweep.bundle.js; on top of the first one the licences of what is kept in it.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync } from "node:fs";
import { build } from "esbuild";

const here = new URL("./", import.meta.url);
const read = (name) => readFileSync(new URL(name, here), "utf8");
// What a test compares: a bundle is as new as these files.
const sources = [...readdirSync(here).filter((name) => name.endsWith(".js")), "package-lock.json"].sort();
const digest = createHash("sha256");
for (const name of sources) digest.update(`${name}\n${read(name)}`);

const sum = `/* sources sha256 ${digest.digest("hex")}\n`;
const shared = {
  absWorkingDir: here.pathname,
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2023",
  legalComments: "none",
  charset: "ascii",
};

const banner = { js: `${sum}\n${read("../page.LICENSES.txt")}*/` };
await build({ ...shared, entryPoints: ["main.js"], outfile: "../page.bundle.js", banner });
// Nothing of others in it.
for (const name of ["search", "sweep"]) {
  await build({ ...shared, entryPoints: [`${name}.js`], outfile: `../${name}.bundle.js`, banner: { js: `${sum}*/` } });
}
