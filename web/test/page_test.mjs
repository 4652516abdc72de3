// The page in a real browser, of a finished run and of a live one.   OASLAM_BINARY=... OASLAM_SOURCE_DIR=... node --test web/test/page_test.mjs
// Pictures go to OASLAM_SCREENSHOTS where that is set.
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

const BINARY = process.env.OASLAM_BINARY;
const CLIP = join(process.env.OASLAM_SOURCE_DIR, "data", "sample", "map_front");
const INPUT = ["--images", `${CLIP}/video.mp4`, "--camera", `${CLIP}/camera.yaml`, "--detections", `${CLIP}/detections.json`];
const CHROMIUM = process.env.OASLAM_CHROMIUM ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find(existsSync);

const playwright = await import("playwright-core").catch(() => null);
if (!playwright || !CHROMIUM) {
  console.log(`SKIPPED: ${playwright ? "no chromium" : "no playwright-core (npm ci in web/)"}`);
  process.exit(0);
}

const folder = mkdtempSync(join(tmpdir(), "oaslam_page_"));
const out = join(folder, "desk");
const map = join(folder, "desk.map");
let browser;
const processes = [];
process.setMaxListeners(30);

// Starts the program, and resolves to the address of its page.
function serve(...args) {
  const child = spawn(BINARY, args, { stdio: ["ignore", "pipe", "pipe"] });
  processes.push(child);
  return new Promise((resolve, reject) => {
    let text = "";
    const look = (chunk) => {
      text += chunk;
      const url = text.match(/http:\/\/\S+\//)?.[0];
      if (url) resolve({ url, child, ended: new Promise((done) => child.on("exit", (code) => done({ code, text }))) });
    };
    child.stdout.on("data", look);
    child.stderr.on("data", look);
    child.on("exit", () => reject(new Error(`ended: ${text}`)));
  });
}

async function open(url, size = { width: 1440, height: 900 }) {
  const page = await browser.newPage({ viewport: size });
  page.errors = [];
  page.on("pageerror", (error) => page.errors.push(String(error)));
  page.on("console", (message) => message.type() === "error" && page.errors.push(message.text()));
  page.on("request", (request) => /^(http|blob|data)/.test(request.url()) && !request.url().startsWith(url) && !/^(blob|data):/.test(request.url()) && page.errors.push(`foreign request ${request.url()}`));
  await page.goto(url);
  return page;
}

const stat = (page, name) => page.locator(`[data-stat=${name}]`).getAttribute("data-value").then(Number);
const drawn = (page, layer) => page.evaluate((name) => window.oaslam.mapView.layers[name].count, layer);
const picture = (page) => page.locator("#stage").screenshot();
const settle = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

async function shoot(page, name) {
  if (!process.env.OASLAM_SCREENSHOTS) return;
  mkdirSync(process.env.OASLAM_SCREENSHOTS, { recursive: true });
  await page.screenshot({ path: join(process.env.OASLAM_SCREENSHOTS, `${name}.jpg`), type: "jpeg", quality: 82 });
  await page.screenshot({ path: join(process.env.OASLAM_SCREENSHOTS, `${name}.png`) });
}

before(async () => {
  const run = spawnSync(BINARY, ["run", ...INPUT, "--out", out, "--map-out", map, "--quiet"], { encoding: "utf8" });
  assert.equal(run.status, 0, run.stderr);
  browser = await playwright.chromium.launch({
    executablePath: CHROMIUM,
    args: ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
      "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  });
});

after(async () => {
  await browser?.close();
  for (const child of processes) child.kill("SIGKILL");
  rmSync(folder, { recursive: true });
});

test("a finished run: what the files say is what is drawn", async () => {
  const { url } = await serve("view", out, "--map", map, "--images", `${CLIP}/video.mp4`, "--groundtruth", `${CLIP}/groundtruth.txt`, "--port", "0");
  const page = await open(url);
  const objects = JSON.parse(readFileSync(join(out, "objects.json"), "utf8"));
  const info = spawnSync(BINARY, ["info", map], { encoding: "utf8" }).stdout;
  const landmarks = Number(info.match(/landmarks\s+(\d+)/)[1]);
  const keyframes = Number(info.match(/keyframes\s+(\d+)/)[1]);
  await page.waitForFunction((n) => window.oaslam.mapView.layers.objects.count === n, objects.length);
  assert.ok(objects.length > 10);
  assert.equal(await stat(page, "objects"), objects.length);
  assert.equal(await drawn(page, "landmarks"), landmarks);
  assert.equal(await stat(page, "landmarks"), landmarks);
  assert.equal(await drawn(page, "keyframes"), keyframes);
  assert.equal(await stat(page, "frames"), 450);
  // Each ellipsoid is where objects.json puts it.
  const shapes = await page.evaluate(() => window.oaslam.mapView.layers.objects.group.children.map((s) => ({ id: s.userData.object.id, at: s.position.toArray(), size: s.scale.toArray() })));
  for (const object of objects) {
    const shape = shapes.find((s) => s.id === object.id);
    for (let i = 0; i < 3; ++i) {
      assert.ok(Math.abs(shape.at[i] - object.center[i]) < 1e-5);
      assert.ok(Math.abs(shape.size[i] - object.half_axes[i]) < 1e-5);
    }
  }
  const groundtruth = await page.evaluate(() => window.oaslam.store.groundtruth.length / 3);
  assert.equal(groundtruth, 450);

  // Layers switch what is drawn.
  await page.waitForFunction(() => window.oaslam.store.landmarks.known.size > 500); // colours of the images
  await settle(page);
  for (const layer of ["landmarks", "objects", "keyframes"]) {
    const before = await picture(page);
    await page.locator(`[data-layer=${layer}]`).uncheck();
    await settle(page);
    assert.equal(await drawn(page, layer), 0, layer);
    assert.notDeepEqual(await picture(page), before, layer);
    await page.locator(`[data-layer=${layer}]`).check();
    await settle(page);
    assert.ok((await drawn(page, layer)) > 0, layer);
  }

  // A click on an ellipsoid opens its panel.
  const [target] = await page.evaluate(() => {
    const { mapView, store } = window.oaslam;
    return [...store.objects.values()].filter((o) => o.mapped).map((o) => ({ id: o.id, at: mapView.toPage(mapView.layers.objects.shapes.get(o.id).position) }))
      .map((o) => ({ ...o, picked: mapView.layers.objects.pick({ x: (2 * o.at.x) / mapView.element.clientWidth - 1, y: 1 - (2 * o.at.y) / mapView.element.clientHeight }) }))
      .filter((o) => o.picked === o.id && o.at.x > 40 && o.at.y > 80);
  });
  await page.locator("[data-layer=labels]").uncheck();
  const stage = await page.locator("#stage").boundingBox();
  await page.mouse.click(stage.x + target.at.x, stage.y + target.at.y);
  await page.waitForSelector("#panel h2");
  const object = objects.find((o) => o.id === target.id);
  assert.equal(await page.locator("#panel h2").textContent(), `${object.category} ${object.id}`);
  assert.match(await page.locator("#panel dl").textContent(), new RegExp(`observations${object.observations}`));
  assert.ok((await page.locator("#panel .crops img").count()) > 1);
  await page.waitForFunction(() => [...document.querySelectorAll("#panel .crops img")].every((img) => img.naturalWidth > 4));
  await page.locator("[data-layer=labels]").check();

  // The timeline leads to a moment: its camera, and the picture of the nearest keyframe.
  const timeline = await page.locator("#timeline").boundingBox();
  await page.mouse.click(timeline.x + 0.55 * timeline.width, timeline.y + 30);
  await page.waitForFunction(() => window.oaslam.store.chosen?.bitmap);
  const chosen = await page.evaluate(() => ({ ...window.oaslam.store.chosen, visible: window.oaslam.mapView.layers.camera.group.visible }));
  assert.ok(chosen.visible && Math.abs(chosen.frame - 0.55 * 450) < 40, String(chosen.frame));
  assert.ok(chosen.ellipses.length > 3);
  await page.mouse.move(10, 10);
  await settle(page);
  await shoot(page, "viewer");

  // A distance between two landmarks is theirs.
  await page.keyboard.press("Escape");
  await page.keyboard.press("m");
  const measured = await page.evaluate(() => {
    const { mapView, store } = window.oaslam;
    const pageOf = (place) => {
      const p = mapView.toPage(mapView.camera.position.clone().fromArray(store.landmarks.positions, 3 * place));
      return p && { x: (2 * p.x) / mapView.element.clientWidth - 1, y: 1 - (2 * p.y) / mapView.element.clientHeight, rect: mapView.element.getBoundingClientRect() };
    };
    const seen = [];
    for (let i = 0; i < store.landmarks.count && seen.length < 2; i += 97) {
      const at = pageOf(i);
      if (at && Math.abs(at.x) < 0.9 && Math.abs(at.y) < 0.9) seen.push(at);
    }
    seen.forEach((at) => mapView.measure.pick(at));
    mapView.invalidate();
    return mapView.measure.distance;
  });
  assert.ok(measured > 0);
  await settle(page);
  assert.match(await page.locator(".measure").textContent(), /\d units/);
  await shoot(page, "measure");
  await page.locator("[data-view=Image]").click();
  await settle(page);
  await shoot(page, "image");
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("two viewers of a live run: it grows, is held, goes on, and is told to relocalize", async () => {
  const { url, ended } = await serve("run", ...INPUT, "--out", join(folder, "live"), "--viewer", "0", "--viewer-paused", "--mode", "live", "--fps", "10"); // slow: a browser without a graphics card is, too
  const [page, other] = [await open(url), await open(url, { width: 1000, height: 700 })];
  for (const p of [page, other]) await p.waitForFunction(() => window.oaslam.store.status.paused);
  assert.equal(await stat(page, "landmarks"), 0);
  await page.locator("#controls >> text=Step").click();
  await other.waitForFunction(() => window.oaslam.store.frame?.frame === 0);
  await page.locator("#controls >> text=Resume").click();
  for (const p of [page, other]) await p.waitForFunction(() => window.oaslam.store.landmarks.count > 500 && window.oaslam.store.frame?.state === "tracking");
  const early = await page.evaluate(() => ({ keyframes: window.oaslam.store.keyframes.size, frame: window.oaslam.store.frame.frame }));
  await page.waitForFunction((e) => window.oaslam.mapView.layers.objects.count > 2 && window.oaslam.store.keyframes.size > e.keyframes && window.oaslam.store.frame.frame > e.frame, early);
  await page.locator("#controls >> text=Pause").click();
  await page.waitForFunction(() => window.oaslam.store.status.paused);
  const picture = await page.evaluate(() => {
    const { frame } = window.oaslam.store;
    return { width: frame.bitmap?.width, boxes: frame.detections.length, matched: [...frame.landmarks].filter((id) => id !== 0xffffffff).length, inliers: frame.inliers };
  });
  assert.equal(picture.width, 640);
  assert.ok(picture.boxes > 3 && picture.matched > 50, JSON.stringify(picture));
  await settle(page);
  await shoot(page, "live");
  await other.waitForFunction(() => window.oaslam.store.status.paused);
  await page.locator("#controls >> text=Relocalize").click();
  await page.locator("#controls >> text=Step").click();
  await other.waitForFunction(() => window.oaslam.store.events.some((e) => e.kind === "relocalized"));
  await page.locator("#controls >> text=Localization only").click();
  await other.waitForFunction(() => window.oaslam.store.status.mapping === false);
  await shoot(other, "live_small");
  await other.locator("#controls >> text=Resume").click();
  const { code } = await ended;
  assert.equal(code, 0);
  // The last word reached both: the finished map.
  for (const p of [page, other]) {
    await p.waitForFunction(() => !window.oaslam.store.status.live);
    assert.ok((await p.evaluate(() => window.oaslam.store.path.size)) > 300);
    assert.deepEqual(p.errors.filter((e) => !/ERR_CONNECTION_REFUSED/.test(e)), []);
  }
  const summary = JSON.parse(readFileSync(join(folder, "live", "summary.json"), "utf8"));
  assert.equal(await stat(page, "landmarks"), summary.landmarks);
  assert.equal(await stat(other, "objects"), summary.objects);
});
