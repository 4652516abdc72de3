// A program of a user of the package `oaslam`: each name that is used has its type, and what is wrong is refused.
import { ArSession, DeviceTracker, OdometryWorker } from "oaslam";
import { Odometry, type Estimate } from "oaslam/odometry";
import { Client, ServiceError, type Track } from "oaslam/service";
import { ArLayer, startAr } from "oaslam/three";
import { BoxGeometry, Mesh, PerspectiveCamera, type Vector3 } from "three";

export async function follow(image: ImageData): Promise<Float64Array | null> {
  const odometry = await Odometry.create({ camera: { width: 640, height: 480, fx: 525, fy: 525, cx: 319.5, cy: 239.5 } });
  const estimate: Estimate = odometry.process(image, 0);
  // @ts-expect-error: a time is a number
  odometry.process(image, "now");
  return estimate.state === "blind" ? null : (estimate.camFromOdom?.translation ?? null);
}

export async function ask(photo: Blob): Promise<number[]> {
  const client = new Client("http://localhost:8340", { token: "a", retries: 2 });
  const { results } = await client.localize("desk", [photo, { image: photo, gravity: [0, 9.81, 0] }], { camera: "fov:63" });
  await client.placeAnchor("desk", { model: "flag", origin: [0, 0, 0], direction: [0, 0, 1] });
  // @ts-expect-error: an anchor has a model
  await client.placeAnchor("desk", { name: "door" });
  // @ts-expect-error: only what was found has a pose
  void results[0].pose;
  const stream: Track = await client.track("desk");
  stream.sendImage(new Uint8Array(await photo.arrayBuffer()), { time: 1 });
  return results.flatMap((result) => (result.found ? result.pose.position : []));
}

export async function draw(element: HTMLElement): Promise<Vector3 | undefined> {
  const ar = await startAr({ element, service: { url: "http://localhost:8340", map: "desk" }, content: ({ name }) => (name === "door" ? new Mesh(new BoxGeometry()) : null) });
  ar.onTap = ({ hit, ray }) => {
    if (hit) ar.place(new Mesh(new BoxGeometry()), hit).scale.setScalar(0.1 * hit.distance);
    if (ray) ar.session.client?.placeAnchor("desk", { model: "flag", ...ray }).catch((error: unknown) => error instanceof ServiceError && error.status);
    // @ts-expect-error: there may be no hit
    ar.place(new Mesh(), hit);
  };
  const layer = new ArLayer(await ArSession.start());
  layer.update(new PerspectiveCamera(), ar.renderer.domElement);
  return layer.hit(1, 2)?.position;
}

export const others: unknown[] = [DeviceTracker, OdometryWorker];
