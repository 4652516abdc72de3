// The odometry of this page: its worker is part of the page (build.mjs), its module a file of the program.
import thread from "oaslam:odometry_thread";

/** @type {string | null} */ let url = null;
export function odometryThread() {
  url ??= URL.createObjectURL(new Blob([thread], { type: "text/javascript" }));
  return new Worker(url, { type: "module" });
}

/** @param {import("../service.js").Service} service */
export const moduleOf = (service) => new URL(`${service.base}/oaslam_odometry.wasm`);
