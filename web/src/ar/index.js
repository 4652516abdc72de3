export { ArSession } from "./session.js";
export { DeviceTracker } from "../device/device_tracker.js";
