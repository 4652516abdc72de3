// The odometry of this page: its worker is part of the page (build.mjs), its module lies beside the page.
import thread from "oaslam:odometry_thread";

/** @type {string | null} */ let url = null;
export function odometryThread() {
  url ??= URL.createObjectURL(new Blob([thread], { type: "text/javascript" }));
  return new Worker(url, { type: "module" });
}

export const WASM = new URL("oaslam_odometry.wasm", document.baseURI);
