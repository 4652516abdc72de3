// The package `oaslam` for npm, as a folder: web/npm, the bundles of its exports, their types, and the odometry's module.
//   node build.mjs npm [FOLDER]     FOLDER: build/npm of the repository unless given; `npm pack` there makes the file to install
import { spawnSync } from "node:child_process";
import { copyFileSync, cpSync, mkdirSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const root = dirname(fileURLToPath(import.meta.url));
const source = join(root, "src");
const ENTRIES = {
  index: join(source, "ar", "index.js"),
  odometry: join(source, "odometry", "oaslam_odometry.js"),
  odometry_thread: join(source, "odometry", "odometry_thread.js"), // the worker that OdometryWorker starts
  service: join(source, "client", "index.js"),
  three: join(source, "three", "index.js"),
};
const DECLARATIONS = ["messages.d.ts", join("client", "api.d.ts")]; // that are written by hand or made before
const BANNER = "/* OA-SLAM: Apache-2.0 */";

// The version of the project, and the package as it is in web/npm.
function manifest() {
  const [, version] = readFileSync(join(root, "..", "CMakeLists.txt"), "utf8").match(/^project\(oaslam VERSION ([\d.]+)/m) ?? [];
  const { name, ...rest } = JSON.parse(readFileSync(join(root, "npm", "package.json"), "utf8"));
  return { name, version, ...rest };
}

async function bundle(folder) {
  const { build } = await import("esbuild");
  await build({
    entryPoints: ENTRIES, outdir: folder, bundle: true, splitting: true, minify: true, charset: "ascii", format: "esm", target: "es2022",
    external: ["three", "three/*"], chunkNames: "part-[hash]", logLevel: "warning", banner: { js: BANNER },
  });
  copyFileSync(join(root, "dist", "oaslam_odometry.wasm"), join(folder, "oaslam_odometry.wasm"));
}

function declare(folder) {
  const options = ["--declaration", "--emitDeclarationOnly", "--allowJs", "--strict", "--noImplicitAny", "false", "--strictPropertyInitialization", "false", "--skipLibCheck",
    "--target", "es2022", "--lib", "es2023,dom,dom.iterable", "--module", "esnext", "--moduleResolution", "bundler", "--types", "", "--ignoreConfig", "--rootDir", source, "--outDir", folder];
  const { status } = spawnSync(process.execPath, [join(root, "node_modules", "typescript", "bin", "tsc"), ...options, ...Object.values(ENTRIES)], { stdio: "inherit" });
  if (status !== 0) throw new Error("no types of the package");
  for (const file of DECLARATIONS) copyFileSync(join(source, file), join(folder, file));
  for (const file of readdirSync(folder, { recursive: true, encoding: "utf8" }).filter((name) => name.endsWith(".d.ts"))) name(join(folder, file));
}

// With "moduleResolution": "node16" the names of files have to be whole.
function name(file) {
  writeFileSync(file, readFileSync(file, "utf8").replace(/((?:from|import\() ?"\.[^"]*?)(?:\.js)?"/g, '$1.js"'));
}

export async function buildPackage(folder = join(root, "..", "build", "npm")) {
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(join(folder, "dist"), { recursive: true });
  writeFileSync(join(folder, "package.json"), JSON.stringify(manifest(), null, 2) + "\n");
  for (const [from, to] of [[join(root, "npm", "README.md"), "README.md"], [join(root, "..", "LICENSE"), "LICENSE"], [join(root, "npm", "examples"), "examples"]])
    cpSync(from, join(folder, to), { recursive: true });
  await bundle(join(folder, "dist"));
  declare(join(folder, "types"));
  console.log(`${folder}: oaslam_odometry.wasm has ${(statSync(join(folder, "dist", "oaslam_odometry.wasm")).size / 1024).toFixed(0)} KB`);
}
