// A phone for tests: Chromium with a window of its size, and a file as its camera.
import { spawnSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const CHROMIUM = process.env.OASLAM_CHROMIUM ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find(existsSync);
const playwright = await import("playwright-core").catch(() => null);

// Ends the program with a line that says what is missing.
export function skipUnlessReady() {
  const missing = !playwright ? "no playwright-core (npm ci in web/)" : !CHROMIUM ? "no chromium" : spawnSync("ffmpeg", ["-version"]).error ? "no ffmpeg" : null;
  if (!missing) return;
  console.log(`SKIPPED: ${missing}`);
  process.exit(0);
}

export const folder = mkdtempSync(join(tmpdir(), "oaslam_phone_"));
process.on("exit", () => rmSync(folder, { recursive: true, force: true }));

// Writes the images from `from` to `to` (exclusive) of a video as a file that Chromium takes for a camera.
export function cameraFile(name, video, from = 0, to = Infinity) {
  const file = join(folder, `${name}.mjpeg`);
  const select = Number.isFinite(to) ? `between(n,${from},${to - 1})` : `gte(n,${from})`;
  const made = spawnSync("ffmpeg", ["-v", "error", "-y", "-i", video, "-vf", `select='${select}'`, "-vsync", "0", "-c:v", "mjpeg", "-q:v", "2", file], { encoding: "utf8" });
  if (made.status !== 0) throw new Error(made.stderr);
  return file;
}

// Writes a video there and back, so that it can be played for ever without a cut. Its lowest eight rows tell the number of the image, in blocks of black and
// white (imageNumberIn): content is compared with the truth of the very image that it is drawn in.
const DIGITS = 10, BLOCK = 16;
export function numberedCameraFile(name, video) {
  const file = join(folder, `${name}.mjpeg`);
  const digits = Array.from({ length: DIGITS }, (_, i) => `drawbox=x=${BLOCK * i}:y=ih-8:w=${BLOCK}:h=8:t=fill:color=white:enable='mod(floor(n/${2 ** i}),2)'`);
  const filter = `split[a][b];[b]reverse[c];[a][c]concat,drawbox=x=0:y=ih-8:w=${BLOCK * DIGITS}:h=8:t=fill:color=black,${digits.join()}`;
  const made = spawnSync("ffmpeg", ["-v", "error", "-y", "-i", video, "-filter_complex", filter, "-c:v", "mjpeg", "-q:v", "2", file], { encoding: "utf8" });
  if (made.status !== 0) throw new Error(made.stderr);
  return file;
}

// Keeps of each image that the page draws, in window.drawn: its number, the pose that was drawn with, how old the place was (s), and how long after the image
// it was drawn (ms).
export function watchDrawing(page) {
  return page.evaluate(([digits, block]) => {
    const { session, view } = window.oaslam;
    const { process } = session;
    let number = 0;
    session.process = (image, time) => {
      number = 0;
      for (let i = 0; i < digits; ++i) if (image.data[4 * ((image.height - 4) * image.width + block * (i + 0.5))] > 128) number += 2 ** i;
      return process.call(session, image, time);
    };
    window.drawn = [];
    const { show } = view;
    view.show = (tracked) => {
      show.call(view, tracked);
      window.drawn.push({ number, state: tracked.state, pose: tracked.pose, age: tracked.age, sigma: tracked.sigma / tracked.depth, late: performance.now() - 1000 * tracked.time });
    };
  }, [DIGITS, BLOCK]);
}

const browsers = [];
export async function launch(file) {
  const browser = await playwright.chromium.launch({
    executablePath: CHROMIUM,
    args: ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-features=LocalNetworkAccessChecks",
      "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
      "--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream", ...(file ? [`--use-file-for-fake-video-capture=${file}`] : [])],
  });
  browsers.push(browser);
  return browser;
}

export async function closeAll() {
  for (const browser of browsers.splice(0)) await browser.close();
}

export const LANDSCAPE = { width: 844, height: 390 };
export const PORTRAIT = { width: 390, height: 844 };

// A page whose errors are in `errors`.
export async function newPage(browser, { size = LANDSCAPE, scale = 1, ...options } = {}) {
  const context = await browser.newContext({ viewport: size, deviceScaleFactor: scale, hasTouch: true, isMobile: true, ignoreHTTPSErrors: true, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(120000); // a busy machine draws slowly
  page.errors = [];
  page.on("pageerror", (error) => page.errors.push(String(error)));
  page.on("console", (message) => message.type() === "error" && page.errors.push(message.text()));
  return page;
}

export const settle = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

// The pixels of a still picture that content changes: their number, the lowest one, their box and middle.
export async function contentPixels(page) {
  // The picture is held at one moment, however slow the machine is.
  await page.waitForFunction(() => {
    const { view, source } = window.oaslam;
    if (!view.isShowing) return false;
    source.held = source.onFrame;
    source.onFrame = () => {};
    for (const part of document.querySelectorAll(".labels, header, footer")) part.style.visibility = "hidden";
    return true;
  });
  const shot = async (on) => {
    await page.evaluate((on) => {
      const { view } = window.oaslam;
      view.anchors.setVisible(on);
      view.draw();
    }, on);
    await settle(page);
    return (await page.screenshot()).toString("base64");
  };
  const shots = [await shot(false), await shot(true)];
  await page.evaluate(() => {
    const { source } = window.oaslam;
    source.onFrame = source.held;
    for (const part of document.querySelectorAll(".labels, header, footer")) part.style.visibility = "";
  });
  const decoder = await page.context().newPage();
  const found = await decoder.evaluate(async ([shots, width]) => {
    const pictures = await Promise.all(shots.map(async (shot) => {
      const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${shot}`)).blob());
      const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
      const context = canvas.getContext("2d");
      context.drawImage(bitmap, 0, 0);
      return context.getImageData(0, 0, bitmap.width, bitmap.height);
    }));
    const [a, b] = pictures.map(({ data }) => data);
    const px = width / pictures[0].width;
    const result = { count: 0, lowest: null, box: [Infinity, Infinity, -Infinity, -Infinity], middle: { x: 0, y: 0 } };
    for (let i = 0; i < a.length / 4; ++i) {
      if (Math.abs(a[4 * i] - b[4 * i]) + Math.abs(a[4 * i + 1] - b[4 * i + 1]) + Math.abs(a[4 * i + 2] - b[4 * i + 2]) < 60) continue;
      const [x, y] = [((i % pictures[0].width) + 0.5) * px, (Math.floor(i / pictures[0].width) + 0.5) * px];
      ++result.count;
      result.lowest = { x, y };
      result.box = [Math.min(result.box[0], x), Math.min(result.box[1], y), Math.max(result.box[2], x), Math.max(result.box[3], y)];
      result.middle = { x: result.middle.x + x, y: result.middle.y + y };
    }
    result.middle = { x: result.middle.x / result.count, y: result.middle.y / result.count };
    return result;
  }, [shots, page.viewportSize().width]);
  await decoder.close();
  return found;
}

export async function shoot(page, name) {
  if (!process.env.OASLAM_SCREENSHOTS) return;
  mkdirSync(process.env.OASLAM_SCREENSHOTS, { recursive: true });
  await page.screenshot({ path: join(process.env.OASLAM_SCREENSHOTS, `${name}.png`) });
}
