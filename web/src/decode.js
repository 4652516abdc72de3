const TYPES = { f32: Float32Array, u32: Uint32Array, u8: Uint8Array };

/**
 * A binary message of the viewer: u32 length of the JSON header, the header, the arrays that it names, each padded to four bytes.
 * @param {ArrayBuffer} buffer
 * @returns {import("./messages").ViewerMessage}
 */
export function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const message = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  let offset = 4 + length;
  for (const [name, type, count] of message.arrays ?? []) {
    arrays[name] = new TYPES[type](buffer, offset, count);
    offset += Math.ceil((count * TYPES[type].BYTES_PER_ELEMENT) / 4) * 4;
  }
  message.arrays = arrays;
  return message;
}
