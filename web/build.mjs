// Bundles src/ and the packages that it uses into dist/: each page is one document without references; the odometry is an ES module
// with its types, beside what tools/build_odometry_wasm makes.   node build.mjs [--check]    (`npm`: the package instead, npm_package.mjs)
// A bundle states the hash of its sources; --check, which needs no packages, tells whether it is the hash of those that are here.
import { spawnSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";
import { API_TYPES, apiTypes } from "./api_types.mjs";
import { buildPackage } from "./npm_package.mjs";
import { isModuleOfSources } from "./odometry_module.mjs";

const root = dirname(fileURLToPath(import.meta.url));
// `folder` has the page's page.html, main.jsx and style.css.
const PAGES = [
  { what: "viewer", folder: join(root, "src"), bundle: join(root, "dist", "index.html") },
  { what: "page for phones", folder: join(root, "src", "camera"), bundle: join(root, "dist", "camera.html") },
];
const ODOMETRY = { source: join(root, "src", "odometry", "oaslam_odometry.js"), bundle: join(root, "dist", "oaslam_odometry.js") };

// Packages that are part of the pages; their licences ask for a notice.
const PACKAGES = { three: "three.js (https://threejs.org)", preact: "Preact (https://preactjs.com)" };

function filesUnder(folder) {
  return readdirSync(folder, { withFileTypes: true })
    .flatMap((entry) => (entry.isDirectory() ? filesUnder(join(folder, entry.name)) : [join(folder, entry.name)]))
    .sort();
}

function hashOfSources() {
  const hash = createHash("sha256");
  for (const file of [...filesUnder(join(root, "src")), join(root, "build.mjs"), join(root, "package-lock.json")]) {
    hash.update(relative(root, file) + "\0").update(readFileSync(file)).update("\0");
  }
  return hash.digest("hex");
}

// The worker of the odometry, as the text of a module: a page has no references.
const THREAD = {
  name: "odometry_thread",
  setup({ onResolve, onLoad, esbuild }) {
    onResolve({ filter: /^oaslam:odometry_thread$/ }, ({ path }) => ({ path, namespace: "thread" }));
    onLoad({ filter: /.*/, namespace: "thread" }, async () => {
      const thread = join(root, "src", "odometry", "odometry_thread.js");
      const { outputFiles } = await esbuild.build({ bundle: true, minify: true, write: false, charset: "ascii", format: "esm", target: "es2022", legalComments: "none", entryPoints: [thread] });
      return { contents: outputFiles[0].text, loader: "text" };
    });
  },
};

async function build({ what, folder, bundle }) {
  const { build: esbuild } = await import("esbuild");
  const options = { bundle: true, minify: true, write: false, charset: "ascii", target: "es2022", legalComments: "none", logLevel: "warning" };
  const script = await esbuild({ ...options, entryPoints: [join(folder, "main.jsx")], format: "iife", plugins: [THREAD], define: { "import.meta.url": "document.baseURI" }, jsx: "automatic", jsxImportSource: "preact" });
  const style = await esbuild({ ...options, entryPoints: [join(folder, "style.css")] });
  const notices = Object.entries(PACKAGES).map(([name, title]) => `${title}:\n\n${readFileSync(join(root, "node_modules", name, "LICENSE"), "utf8").replaceAll("\u00a9", "(c)").trim()}`);
  const page = readFileSync(join(folder, "page.html"), "utf8")
    .replace("<!--notice-->", () => `<!--\nsources ${hashOfSources()}\n\nOA-SLAM's ${what}: Apache-2.0. It contains:\n\n${notices.join("\n\n")}\n-->`)
    .replace("/*style*/", () => style.outputFiles[0].text.trim())
    .replace("/*script*/", () => script.outputFiles[0].text.trim().replaceAll("</script", "<\\/script"));
  if (/[\u0080-\uffff]/.test(page)) throw new Error("the page is not plain ASCII");
  mkdirSync(dirname(bundle), { recursive: true });
  writeFileSync(bundle, page);
  console.log(`${relative(process.cwd(), bundle)}: ${(page.length / 1024).toFixed(0)} KB`);
}

async function buildOdometry() {
  const { build: esbuild } = await import("esbuild");
  const banner = { js: `/*\nsources ${hashOfSources()}\n\nOA-SLAM's visual odometry: Apache-2.0.\n*/` };
  await esbuild({ bundle: true, minify: true, charset: "ascii", format: "esm", target: "es2022", logLevel: "warning", banner, entryPoints: [ODOMETRY.source], outfile: ODOMETRY.bundle });
  const types = ["--declaration", "--emitDeclarationOnly", "--allowJs", "--target", "es2022", "--lib", "es2023,dom", "--types", "", "--ignoreConfig", "--outDir", dirname(ODOMETRY.bundle)];
  const { status } = spawnSync(process.execPath, [join(root, "node_modules", "typescript", "bin", "tsc"), ...types, ODOMETRY.source], { stdio: "inherit" });
  if (status !== 0) throw new Error("no types of the odometry");
}

function fail(bundle, tool) {
  console.error(`${relative(root, bundle)} was not made of these sources: run ${tool} and commit it`);
  process.exit(1);
}

function check({ bundle }) {
  const stated = readFileSync(bundle, "latin1").match(/^sources ([0-9a-f]{64})$/m)?.[1];
  if (stated !== hashOfSources()) fail(bundle, "tools/build_web");
}

if (process.argv.includes("--check")) {
  if (readFileSync(API_TYPES, "utf8") !== apiTypes()) fail(API_TYPES, "tools/build_web");
  for (const bundle of [...PAGES, ODOMETRY]) check(bundle);
  if (!isModuleOfSources()) fail(ODOMETRY.bundle.replace(/js$/, "wasm"), "tools/build_odometry_wasm");
} else if (process.argv[2] === "npm") {
  await buildPackage(process.argv[3]);
} else {
  writeFileSync(API_TYPES, apiTypes());
  for (const page of PAGES) await build(page);
  await buildOdometry();
}
