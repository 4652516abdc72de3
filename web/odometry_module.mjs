// Whether the committed module of the odometry was made of the sources that are here. Beside it is the list of its sources with
// two hashes: of the module, and of those.   node odometry_module.mjs MODULE < paths: commits a module with its list
import { createHash } from "node:crypto";
import { readFileSync, statSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const root = dirname(fileURLToPath(import.meta.url));
const MODULE = join(root, "dist", "oaslam_odometry.wasm");
const LIST = join(root, "dist", "oaslam_odometry.sources");

// Of paths in the repository.
function listOf(paths) {
  const hash = createHash("sha256");
  for (const path of paths) hash.update(path + "\0").update(readFileSync(join(root, "..", path))).update("\0");
  const module = createHash("sha256").update(readFileSync(MODULE)).digest("hex");
  return [`module ${module}`, `sources ${hash.digest("hex")}`, ...paths, ""].join("\n");
}

/** True where the module and its sources are those of the list. */
export function isModuleOfSources() {
  const list = readFileSync(LIST, "utf8");
  const paths = list.split("\n").slice(2, -1);
  try {
    return paths.length > 0 && listOf(paths) === list;
  } catch {
    return false; // a source is gone
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const paths = readFileSync(0, "utf8").split("\n").filter(Boolean);
  writeFileSync(MODULE, readFileSync(process.argv[2]));
  writeFileSync(LIST, listOf(paths));
  console.log(`web/dist/oaslam_odometry.wasm: ${(statSync(MODULE).size / 1024).toFixed(0)} KB, compressed ${(gzipSync(readFileSync(MODULE), { level: 9 }).length / 1024).toFixed(0)} KB`);
}
