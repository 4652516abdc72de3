// The package `oaslam` for npm: made, packed, installed from the file into an empty folder, and used there in Node and in a browser.
// OASLAM_BINARY=... OASLAM_SOURCE_DIR=... node --test web/test/npm_test.mjs     Pictures go to OASLAM_SCREENSHOTS where that is set.
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { cpSync, existsSync, mkdirSync, readFileSync, readdirSync, symlinkSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { dirname, join } from "node:path";
import { after, afterEach, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { distanceTo, FOCAL, gravityIn, onDesk, pixelOf, posesOf, SIZE } from "./npm/truth.mjs";
import { closeAll, folder, launch, newPage, settle, shoot, skipUnlessReady } from "./phone.mjs";

skipUnlessReady();
const HERE = dirname(fileURLToPath(import.meta.url));
const MODULES = join(HERE, "..", "node_modules");
if (!existsSync(join(MODULES, "esbuild"))) {
  console.log("SKIPPED: no esbuild (npm ci in web/)");
  process.exit(0);
}
const { buildPackage } = await import("../npm_package.mjs");
const BINARY = process.env.OASLAM_BINARY;
const CLIP = join(process.env.OASLAM_SOURCE_DIR, "data", "sample", "map_front");
const VIDEO = join(CLIP, "video.mp4");
const TOKEN = "a-token-that-may-write";
const LONG = { timeout: 400000 };

const user = join(folder, "user"); // the folder of one who uses the package
const images = join(user, "images"); // of the clip
const poses = posesOf(CLIP);
let tarball;
let service; // its address
const children = [];

function run(program, options, settings = {}) {
  const done = spawnSync(program, options, { encoding: "utf8", cwd: user, ...settings });
  assert.equal(done.status, 0, `${program} ${options.join(" ")}: ${done.error ?? ""}${done.stdout}${done.stderr}`);
  return done.stdout;
}

const freePort = () => new Promise((resolve) => {
  const server = createServer().listen(0, "127.0.0.1", () => {
    const { port } = /** @type {import("node:net").AddressInfo} */ (server.address());
    server.close(() => resolve(port));
  });
});

// Starts a program that serves at a port, and resolves when it answers.
async function serve(program, options, port, cwd = user) {
  const child = spawn(program, options, { cwd, stdio: "ignore" });
  children.push(child);
  for (let i = 0; i < 600; ++i) {
    if (await fetch(`http://localhost:${port}/`).catch(() => null)) return;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  throw new Error(`${program} does not serve`);
}

async function serveFiles(where) {
  const port = await freePort();
  await serve("python3", ["-m", "http.server", String(port), "--bind", "127.0.0.1"], port, where);
  return `http://localhost:${port}/`;
}

before(async () => {
  mkdirSync(images, { recursive: true });
  run("ffmpeg", ["-v", "error", "-i", VIDEO, "-q:v", "2", "-start_number", "0", join(images, "%04d.jpg")]);
  const built = join(folder, "package");
  await buildPackage(built);
  tarball = join(folder, run("npm", ["pack", "--silent", "--pack-destination", folder], { cwd: built }).trim());
  writeFileSync(join(user, "package.json"), JSON.stringify({ private: true, type: "module" }));
  run("npm", ["install", "--offline", "--no-audit", "--no-fund", tarball]);
  cpSync(join(MODULES, "three"), join(user, "node_modules", "three"), { recursive: true });
  cpSync(join(user, "node_modules", "oaslam", "examples", "static", "index.html"), join(user, "index.html"));
});
afterEach(closeAll);
after(() => {
  for (const child of children) child.kill("SIGKILL");
});

test("the package has what it says, and nothing of the project beside it", () => {
  const root = join(user, "node_modules", "oaslam");
  assert.deepEqual(readdirSync(root).sort(), ["LICENSE", "README.md", "dist", "examples", "package.json", "types"]);
  const { version, exports, dependencies } = JSON.parse(readFileSync(join(root, "package.json"), "utf8"));
  assert.match(readFileSync(join(process.env.OASLAM_SOURCE_DIR, "CMakeLists.txt"), "utf8"), new RegExp(`oaslam VERSION ${version} `));
  assert.equal(dependencies, undefined);
  for (const target of Object.values(exports).flatMap((entry) => (typeof entry === "string" ? [entry] : Object.values(entry)))) assert.ok(existsSync(join(root, target)), target);
  // What the README calls the thirty lines is the example.
  const readme = readFileSync(join(root, "README.md"), "utf8");
  for (const example of ["static/index.html", "react-three-fiber/main.jsx", "a-frame/index.html"]) assert.ok(readme.includes(`examples/${example}`), example);
  assert.ok(readFileSync(join(root, "examples", "static", "index.html"), "utf8").split("\n").length <= 36);
});

test("its types serve a program in TypeScript", () => {
  for (const name of readdirSync(join(MODULES, "@types"))) {
    mkdirSync(join(user, "node_modules", "@types"), { recursive: true });
    if (name === "three") symlinkSync(join(MODULES, "@types", name), join(user, "node_modules", "@types", name));
  }
  cpSync(join(HERE, "npm", "consumer.ts"), join(user, "consumer.ts"));
  for (const resolution of ["bundler", "node16"]) {
    const module = resolution === "bundler" ? "esnext" : "node16";
    run(process.execPath, [join(MODULES, "typescript", "bin", "tsc"), "--noEmit", "--strict", "--skipLibCheck", "--ignoreConfig", "--target", "es2022", "--lib", "es2023,dom", "--types", "", "--module", module,
      "--moduleResolution", resolution, "consumer.ts"]);
  }
});

test("in Node: the odometry follows the sample", () => {
  cpSync(join(HERE, "npm", "follow_sample.mjs"), join(user, "follow_sample.mjs"));
  const told = JSON.parse(run(process.execPath, ["follow_sample.mjs", VIDEO, "trajectory.txt"]));
  assert.equal(told.images, 450);
  assert.ok(told.poses > 440);
  assert.equal(told.runs, 1);
  const text = run(BINARY, ["evaluate", "trajectory", "trajectory.txt", join(CLIP, "groundtruth.txt")]);
  console.log(JSON.stringify(told));
  assert.ok(Number(text.match(/ATE position +([\d.]+)/)[1]) < 0.005, text); // metres
});

test("in Node: the client of the service", LONG, async () => {
  const maps = join(folder, "maps");
  mkdirSync(maps);
  run(BINARY, ["run", "--images", VIDEO, "--camera", `${CLIP}/camera.yaml`, "--detections", `${CLIP}/detections.json`, "--out", join(folder, "desk"), "--map-out", join(maps, "desk.map"), "--quiet"]);
  writeFileSync(join(folder, "tokens"), `write ${TOKEN}\n`);
  const port = await freePort();
  await serve(BINARY, ["serve", "--maps", maps, "--port", String(port), "--token-file", join(folder, "tokens"), "--detector", "none"], port);
  service = `http://localhost:${port}`;
  cpSync(join(HERE, "npm", "ask_service.mjs"), join(user, "ask_service.mjs"));
  const flags = Number(process.versions.node.split(".")[0]) < 22 ? ["--experimental-websocket"] : [];
  assert.equal(run(process.execPath, [...flags, "--no-warnings", "ask_service.mjs", `http://127.0.0.1:${port}`, TOKEN, images]), "done\n");
});

// A page of the service's own address, which takes the package from the user's folder. (Chromium takes a page that a test fulfils for one of another network: phone.mjs
// allows it to ask this machine.)
const MAP_PAGE = `<!doctype html><meta name="viewport" content="width=device-width, initial-scale=1"><style>html, body { height: 100%; margin: 0; }</style><link rel="icon" href="data:,">
<script type="importmap">{ "imports": { "three": "./node_modules/three/build/three.module.js", "three/examples/": "./node_modules/three/examples/", "oaslam/three": "./node_modules/oaslam/dist/three.js" } }</script>
<button>start</button>
<script type="module">
  import { BoxGeometry, Mesh, MeshBasicMaterial } from "three";
  import { startAr } from "oaslam/three";
  const camera = { width: 640, height: 480, fx: 525, fy: 525, cx: 319.5, cy: 239.5 };
  const service = { url: location.origin, map: "desk", token: "${TOKEN}" };
  document.querySelector("button").onclick = async ({ target }) => {
    window.ar = await startAr({ camera, service, content: () => new Mesh(new BoxGeometry().translate(0, 0.5, 0), new MeshBasicMaterial({ color: "deeppink" })) });
    target.remove();
    ar.onTap = ({ ray }) => (window.placed = ar.session.client.placeAnchor("desk", { model: "flag", size: 0.1, ...ray }));
  };
</script>`;

test("a page with a map: a tap places an anchor, whose content stands there for everybody", LONG, async () => {
  const types = { ".js": "text/javascript", ".wasm": "application/wasm", ".jpg": "image/jpeg" };
  const page = await pageOf(`${service}/app/`, (route) => {
    const path = new URL(route.request().url()).pathname.slice("/app/".length);
    if (path === "") return route.fulfill({ body: MAP_PAGE, contentType: "text/html" });
    return route.fulfill({ path: join(user, path), contentType: types[path.slice(path.lastIndexOf("."))] });
  });
  await page.locator("button").tap();
  const isPlaced = () => page.evaluate(() => window.ar.session.tracked?.world === "map");
  let i = 0;
  for (; i < 300 && !(i > TAPPED && (await isPlaced())); ++i) {
    await showImage(page, `${service}/app/images/`, i);
    await page.waitForTimeout(50); // the service is asked twice a second
  }
  assert.ok(await isPlaced(), "the camera is not found in the map");
  const foot = onDesk(poses[TAPPED], NOTE);
  await settle(page);
  const [x, y] = pixelOf(poses[i - 1], foot);
  await page.touchscreen.tap(x, y);
  await page.waitForFunction(() => window.placed);
  const { name } = await page.evaluate(() => window.placed);
  await page.waitForFunction((name) => window.ar.layer.store.anchors.some((anchor) => anchor.name === name), name);
  for (const last = i + 60; i < last; ++i) await showImage(page, `${service}/app/images/`, i);
  const middle = pixelOf(poses[i - 1], [foot[0], foot[1], foot[2] + 0.05]); // of the cube: the map is in metres
  const seen = await pinkIn(page);
  console.log(JSON.stringify({ image: i - 1, x: seen.x - middle[0], y: seen.y - middle[1], count: seen.count }));
  assert.ok(seen.count > 100 && Math.hypot(seen.x - middle[0], seen.y - middle[1]) < 8, JSON.stringify({ seen, middle }));
  await shoot(page, "npm_map");
  assert.deepEqual(page.errors, []);
});

// A page whose camera shows the images of the clip, one after the other, each when the odometry has answered to the one before; and feels its gravity.
async function pageOf(url, answer = (route) => route.continue()) {
  const page = await newPage(await launch(), { size: SIZE });
  await page.route("**/app/**", answer);
  await page.addInitScript(({ width, height }) => {
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    const [track] = canvas.captureStream(0).getTracks();
    navigator.mediaDevices.getUserMedia = async () => new MediaStream([track]);
    window.clip = {
      answers: 0, // of the odometry's worker
      async show(image) {
        this.image = await createImageBitmap(await (await fetch(image)).blob());
      },
      expose([x, y, z]) {
        const angle = (screen.orientation.angle * Math.PI) / 180;
        const [right, up] = [x, -y]; // in the screen's axes; then in the device's
        const [a, b] = [right * Math.cos(angle) + up * Math.sin(angle), up * Math.cos(angle) - right * Math.sin(angle)];
        dispatchEvent(new DeviceMotionEvent("devicemotion", { accelerationIncludingGravity: { x: -a, y: -b, z } }));
        canvas.getContext("2d").drawImage(this.image, 0, 0); // a canvas that was not drawn on gives no image
        track.requestFrame();
      },
    };
    window.Worker = class extends Worker {
      constructor(...options) {
        super(...options);
        this.addEventListener("message", () => ++window.clip.answers);
      }
    };
  }, SIZE);
  await page.goto(url);
  return page;
}

// Shows one image until the odometry has answered to it.
async function showImage(page, images, i) {
  await page.evaluate(async ({ url, gravity }) => {
    const { clip } = window;
    await clip.show(url);
    const before = clip.answers;
    for (let n = 0; clip.answers === before; ++n) {
      if (n > 300) throw new Error(`the odometry does not answer: ${document.body.innerText}`);
      clip.expose(gravity);
      for (let k = 0; k < 20 && clip.answers === before; ++k) await new Promise((resolve) => setTimeout(resolve, 10));
    }
  }, { url: `${images}${String(i).padStart(4, "0")}.jpg`, gravity: gravityIn(poses[i]) });
}

// The middle of what is drawn in deep pink, and how much that is.
async function pinkIn(page) {
  await settle(page);
  const { stdout } = spawnSync("ffmpeg", ["-v", "error", "-i", "pipe:0", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], { input: await page.screenshot(), maxBuffer: 2 ** 26 });
  const sum = { x: 0, y: 0, count: 0 };
  for (let i = 0; i < stdout.length / 3; ++i) {
    const [r, g, b] = stdout.subarray(3 * i, 3 * i + 3);
    if (r < 90 || g > 0.3 * r || b < 0.35 * r || b > 0.8 * r) continue;
    sum.x += i % SIZE.width;
    sum.y += Math.floor(i / SIZE.width);
    ++sum.count;
  }
  return { ...sum, x: sum.x / sum.count, y: sum.y / sum.count };
}

const TAPPED = 60; // the image at which content is placed
const NOTE = [328, 310]; // a note on the desk in that image
const NEXT = 30; // images between those that are looked at

// Taps the note in a page, and looks where the cube is in later images: by how many pixels it is off where the truth has it, at most.
// `lift`: of its middle over the note, in its sides.
async function placesContent(page, images, last, lift) {
  const errors = [];
  for (let i = 0; i <= last; ++i) {
    await showImage(page, images, i);
    if (i === TAPPED) {
      await settle(page);
      assert.ok((await pinkIn(page)).count < 50);
      await page.touchscreen.tap(...NOTE);
      await settle(page);
    }
    if (i < TAPPED || i % NEXT !== 0) continue;
    const foot = onDesk(poses[TAPPED], NOTE);
    const side = 0.1 * distanceTo(poses[TAPPED], foot);
    const middle = pixelOf(poses[i], [foot[0], foot[1], foot[2] + lift * side]);
    const seen = await pinkIn(page);
    const width = (FOCAL * side) / distanceTo(poses[i], foot);
    errors.push({ i, x: seen.x - middle[0], y: seen.y - middle[1], area: seen.count / width ** 2 });
    await shoot(page, `npm_${new URL(page.url()).port}_${i}`);
  }
  console.log(page.url(), JSON.stringify(errors.map(({ i, x, y, area }) => [i, x.toFixed(1), y.toFixed(1), area.toFixed(2)])));
  assert.deepEqual(page.errors, []);
  return errors;
}

// The largest distance is that of the last image, in which the note is seen from 1.5 m further along the arc.
function assertPlaced(errors, near) {
  for (const { i, x, y, area } of errors) {
    assert.ok(Math.hypot(x, y) < (i < 200 ? near : 2 * near), `image ${i}: off by ${x}, ${y}`);
    assert.ok(area > 1 && area < 2.5, `image ${i}: of ${area} sides`); // what is seen of a cube
  }
}

test("the example page: content stays where it was placed", LONG, async () => {
  const url = await serveFiles(user);
  const page = await pageOf(url);
  await page.locator("button").tap();
  assertPlaced(await placesContent(page, `${url}images/`, 240, 0.5), 8);
});

test("the example page: where there is no camera it says why", LONG, async () => {
  const url = await serveFiles(user);
  for (const [name, message] of [["NotAllowedError", /^the camera: it is not allowed/], ["NotFoundError", /^the camera: this device has none/], ["NotReadableError", /^the camera: another program has it/]]) {
    const page = await newPage(await launch());
    await page.addInitScript((name) => (navigator.mediaDevices.getUserMedia = async () => Promise.reject(new DOMException("", name))), name);
    await page.goto(url);
    await page.locator("button").tap();
    await page.waitForFunction(() => /^the camera/.test(document.querySelector("button").textContent));
    assert.match(await page.locator("button").textContent(), message);
    await closeAll();
  }
});

// A folder with an example and packages from npm's registry beside ours; null where the registry does not answer.
function exampleFolder(name, dependencies, more = {}) {
  const where = join(folder, name);
  cpSync(join(user, "node_modules", "oaslam", "examples", name), where, { recursive: true });
  writeFileSync(join(where, "package.json"), JSON.stringify({ private: true, type: "module", dependencies: { ...dependencies, oaslam: `file:${tarball}` }, ...more }));
  const { status, stderr } = spawnSync("npm", ["install", "--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=1"], { cwd: where, encoding: "utf8" });
  if (status === 0) return where;
  if (/ENOTFOUND|ECONNREFUSED|ETIMEDOUT|EAI_AGAIN|network|E40[34]/.test(stderr)) return null;
  throw new Error(stderr);
}

test("the example for A-Frame", LONG, async (t) => {
  // A-Frame takes one package from GitHub, which its module has in it already.
  const where = exampleFolder("a-frame", { aframe: "1.8.0" }, { overrides: { "three-bmfont-text": "3.0.1" } });
  if (!where) return t.skip("npm's registry does not answer");
  symlinkSync(images, join(where, "images"));
  const url = await serveFiles(where);
  const page = await pageOf(url);
  await page.locator("#start").tap();
  assertPlaced(await placesContent(page, `${url}images/`, 90, 0), 8);
});

test("the example for React Three Fiber, bundled by Vite", LONG, async (t) => {
  const { version } = JSON.parse(readFileSync(join(MODULES, "three", "package.json"), "utf8"));
  const where = exampleFolder("react-three-fiber", { "@react-three/fiber": "9.8.2", react: "19.3.1", "react-dom": "19.3.1", three: version, vite: "8.3.8" });
  if (!where) return t.skip("npm's registry does not answer");
  run(process.execPath, [join(where, "node_modules", "vite", "bin", "vite.js"), "build", "--logLevel", "error"], { cwd: where });
  const dist = join(where, "dist");
  symlinkSync(images, join(dist, "images"));
  const url = await serveFiles(dist);
  const page = await pageOf(url);
  await page.locator("#root").tap();
  assertPlaced(await placesContent(page, `${url}images/`, 90, 0), 8);
});
