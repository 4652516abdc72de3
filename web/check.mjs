// The types (TypeScript) and the lint (ESLint) of the sources.   node check.mjs
import { spawnSync } from "node:child_process";
import { existsSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const root = dirname(fileURLToPath(import.meta.url));
const TOOLS = [["typescript", "bin/tsc", "-p", "."], ["eslint", "bin/eslint.js", "--max-warnings", "0", "."]];

for (const [name] of TOOLS) {
  if (existsSync(join(root, "node_modules", name))) continue;
  console.log(`SKIPPED: no ${name} (npm ci in web/)`);
  process.exit(0);
}
let isFine = true;
for (const [name, script, ...options] of TOOLS) {
  const { status } = spawnSync(process.execPath, [join(root, "node_modules", name, script), ...options], { cwd: root, stdio: "inherit" });
  console.log(`${name}: ${status === 0 ? "nothing to say" : "see above"}`);
  isFine &&= status === 0;
}
process.exit(isFine ? 0 : 1);
