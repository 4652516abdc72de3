// node mcap_check.mjs FILE.mcap: reads the file by others' readers, from front to back and by its index, decodes each message by the definition in
// the file, and encodes it again. Prints {topic: {type, count, last}}, where `last` is the last message without its bytes; fails on any difference.
import { readFileSync } from "node:fs";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";
import zstd from "@foxglove/wasm-zstd";

await zstd.isLoaded;
const decompressHandlers = { zstd: (bytes, size) => zstd.decompress(bytes, Number(size)) };
const file = new Uint8Array(readFileSync(process.argv[2]));

let streamed = 0;
const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(file);
for (let record; (record = stream.nextRecord()); ) if (record.type === "Message") ++streamed;
if (!stream.done()) throw Error("the file has no end");

const readable = { size: async () => BigInt(file.length), read: async (at, length) => file.slice(Number(at), Number(at + length)) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const topics = {}, codecs = {};
let indexed = 0;
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId), schema = reader.schemasById.get(channel.schemaId);
  if (!codecs[channel.id]) {
    const definition = parse(new TextDecoder().decode(schema.data), { ros2: true });
    codecs[channel.id] = { reader: new MessageReader(definition), writer: new MessageWriter(definition) };
  }
  const value = codecs[channel.id].reader.readMessage(message.data);
  if (Buffer.compare(codecs[channel.id].writer.writeMessage(value), message.data) !== 0) throw Error(`${channel.topic}: other bytes than theirs`);
  topics[channel.topic] = { type: schema.name, count: (topics[channel.topic]?.count ?? 0) + 1, last: value };
  ++indexed;
}
if (indexed !== streamed || BigInt(indexed) !== reader.statistics.messageCount) throw Error(`${streamed} messages, ${indexed} by the index`);
console.log(JSON.stringify(topics, (key, value) => (value instanceof Uint8Array ? value.length : ArrayBuffer.isView(value) ? [...value] : value)));
