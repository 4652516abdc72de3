export { ArSession } from "../ar/session.js";
export { ArLayer } from "./ar_layer.js";
export { Ar, startAr } from "./start_ar.js";
