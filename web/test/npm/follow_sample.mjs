// follow_sample.mjs VIDEO OUT: follows the video's camera by the package's odometry, and writes the trajectory in TUM format; prints the time an image.
import { spawnSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { Odometry } from "oaslam/odometry";

const [, , video, out] = process.argv;
const camera = { width: 640, height: 480, fx: 525, fy: 525, cx: 319.5, cy: 239.5 };
const { stdout } = spawnSync("ffmpeg", ["-v", "error", "-i", video, "-f", "rawvideo", "-pix_fmt", "gray", "-"], { maxBuffer: 2 ** 30 });
const bytes = camera.width * camera.height;
const odometry = await Odometry.create({ camera });
const [lines, times, runs] = [[], [], new Set()];
for (let i = 0; (i + 1) * bytes <= stdout.length; ++i) {
  const begin = performance.now();
  const { camFromOdom, run } = odometry.process(stdout.subarray(i * bytes, (i + 1) * bytes), i / 30);
  times.push(performance.now() - begin);
  runs.add(run);
  if (!camFromOdom) continue;
  const [x, y, z, w] = camFromOdom.rotation;
  const [a, b, c] = camFromOdom.translation;
  // The camera in the odometry's frame: -R^T t
  const [tx, ty, tz] = [2 * (b * z - c * y), 2 * (c * x - a * z), 2 * (a * y - b * x)];
  const position = [a + w * tx - (y * tz - z * ty), b + w * ty - (z * tx - x * tz), c + w * tz - (x * ty - y * tx)].map((v) => -v);
  lines.push([i / 30, ...position, -x, -y, -z, w].join(" "));
}
odometry.delete();
writeFileSync(out, lines.join("\n") + "\n");
times.sort((a, b) => a - b);
console.log(JSON.stringify({ images: times.length, poses: lines.length, runs: runs.size, median: times[times.length >> 1], slow: times[Math.floor(0.99 * times.length)] }));
