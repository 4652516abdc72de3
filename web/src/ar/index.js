export { ArSession } from "./session.js";
export { DeviceTracker } from "../device/device_tracker.js";
export { Place } from "../device/place.js";
export { OdometryWorker } from "../odometry/odometry_worker.js";
