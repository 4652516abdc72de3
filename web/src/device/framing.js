// An image as a message: u32 length of the JSON header (little-endian), header, the image as JPEG (docs/service.md).
// Blanks make the header's length a multiple of four.
export function packImage(header, jpeg) {
  const json = new TextEncoder().encode(JSON.stringify(header));
  const length = 4 * Math.ceil(json.length / 4);
  const message = new Uint8Array(4 + length + jpeg.length).fill(0x20, 4, 4 + length);
  new DataView(message.buffer).setUint32(0, length, true);
  message.set(json, 4);
  message.set(jpeg, 4 + length);
  return message;
}

// The samples of a gyroscope or an IMU (rows of 4 or 7 numbers) as a part of that header.
/** @param {number[][]} rows  @returns {{ imu?: number[][], angular_velocity?: number[][] }} */
export function samplesHeader(rows) {
  if (rows.length === 0) return {};
  return rows[0].length === 7 ? { imu: rows } : { angular_velocity: rows };
}
