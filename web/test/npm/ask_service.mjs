// ask_service.mjs URL TOKEN FOLDER: the package's client against a service that has the map "desk", with images of FOLDER.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { Client, ServiceError } from "oaslam/service";

const [, , url, token, folder] = process.argv;
const image = (i) => new Uint8Array(readFileSync(`${folder}/${String(i).padStart(4, "0")}.jpg`));
const LENS = { width: 640, height: 480, fx: 525, fy: 525, cx: 319.5, cy: 239.5 };
const client = new Client(url, { token });
const refused = (promise, status, message) => assert.rejects(promise, (error) => {
  assert.ok(error instanceof ServiceError, String(error));
  assert.equal(error.status, status);
  assert.match(error.message, message);
  return true;
});

// Maps
assert.deepEqual((await client.maps()).map(({ name }) => name), ["desk"]);
const { objects, digest } = await client.map("desk");
assert.ok(objects.length > 5 && /^[0-9a-f]{64}$/.test(digest));
await refused(client.map("nowhere"), 404, /no map "nowhere"/);
await refused(client.uploadMap("bad", new Uint8Array(100)), 400, /./);
await refused(new Client(url).maps(), 401, /./);
await refused(new Client(url, { token: "wrong" }).maps(), 401, /./);
await refused(new Client("http://127.0.0.1:9").maps(), null, /^http:\/\/127\.0\.0\.1:9: /);
await refused(new Client(`${url}/elsewhere`, { token }).maps(), 404, /./);
for (const bad of ["localhost:8340", "ftp://a", `${url}/?a=b`]) assert.throws(() => new Client(bad), /expected http:\/\/HOST:PORT/);
assert.throws(() => new Client(url, { token: "two words" }), { message: "the token: expected letters, digits and -._~" });
assert.match(await client.metrics(), /^# /m);

// Images
const { results } = await client.localize("desk", [image(60), { image: new Blob([image(200)]), camera: "fov:62.7" }, { camera: LENS, detections: [] }], { camera: LENS });
assert.deepEqual(results.map(({ found }) => found), [true, true, false]);
assert.equal(typeof results[2].why_not, "string");
await refused(client.localize("desk", [image(60)], { mode: "smell" }), 400, /allowed: points/);
await assert.rejects(client.localize("desk", image(60)), { message: "images: expected a list of images" });
await assert.rejects(client.localize("desk", [{ image: "photo.jpg" }]), { message: "image: photo.jpg, expected the bytes of a JPEG or PNG file" });

// Anchors, and a camera that is told of them
const camera = await client.track("desk", { camera: LENS });
assert.deepEqual([camera.hello.map, camera.hello.may_write, camera.anchors.size], ["desk", true, 0]);
const told = camera.waitFor("anchors");
const placed = await client.placeAnchor("desk", { name: "a/b door", model: "flag", pose: { position: [0, 0, 1], rotation: [0, 0, 0, 1] }, size: 0.2 });
assert.equal((await told).version, placed.version);
assert.deepEqual([...camera.anchors.keys()], ["a/b door"]);
const edited = await client.editAnchor("desk", "a/b door", { name: "gate", size: 0.3, turn: 1.5 });
assert.equal(edited.size, 0.3);
const news = await client.anchors("desk", placed.version);
assert.deepEqual([news.anchors.map(({ name }) => name), news.removed], [["gate"], ["a/b door"]]);
await refused(client.placeAnchor("desk", { name: "gate", model: "flag", origin: [0, 0, 0], direction: [0, 0, 1] }), 409, /already/);
await refused(client.placeAnchor("desk", { model: "flag" }), 400, /./);
await client.deleteAnchor("desk", "gate");
await refused(client.deleteAnchor("desk", "gate"), 404, /no anchor/);

// Its images
for (let i = 60; i < 64; ++i) {
  const answer = camera.waitFor("pose");
  const id = camera.sendImage(image(i), { time: i / 30 });
  const { state, pose, ...rest } = await answer;
  assert.equal(rest.id, id);
  assert.match(state, /relocalized|tracking/);
  assert.ok(pose);
}
const problem = camera.waitFor("pose");
camera.sendImage(new Uint8Array(10), { time: 4 });
await refused(problem, null, /./);
const end = new Promise((resolve) => camera.addEventListener("close", resolve));
camera.close();
await end;
assert.throws(() => camera.sendImage(image(60)), { name: "ServiceError", message: "the stream is closed" });
await refused(client.track("nowhere"), 404, /no map/);
await refused(new Client(url, { token: "wrong" }).track("desk"), 401, /./);
await refused(new Client("http://127.0.0.1:9").track("desk"), null, /127\.0\.0\.1:9/);
assert.throws(() => new Client(url, { WebSocket: null }).track("desk"), /Node has one from version 22 on/);

// A new map
const recording = await client.record("new", { camera: LENS });
await refused(recording.finish(), null, /./);
recording.close();
console.log("done");
