// What build.mjs makes of src/odometry/odometry_thread.js: a module as text, for a worker.
declare module "oaslam:odometry_thread" {
  const text: string;
  export default text;
}
