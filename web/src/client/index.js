export { Client } from "./client.js";
export { ServiceError } from "./service_error.js";
export { Record, Track } from "./stream.js";
