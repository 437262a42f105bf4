// Reads a log as Foxglove does: @mcap/core for the file, protobufjs with each channel's own schema. Decodes every message
// of every protobuf channel. Prints a line for each channel: topic, schema, number of messages, numbers in the last message.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import path from "node:path";

const require = createRequire(path.join(process.cwd(), "package.json"));
const { McapIndexedReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");
const protobuf = require("protobufjs");
const { FileDescriptorSet } = require("protobufjs/ext/descriptor");

const bytes = await readFile(process.argv[2]);
const readable = {
  size: async () => BigInt(bytes.byteLength),
  read: async (offset, size) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + size))),
};
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers: await loadDecompressHandlers() });

const types = new Map();
for (const channel of reader.channelsById.values()) {
  if (channel.messageEncoding !== "protobuf") continue;
  const schema = reader.schemasById.get(channel.schemaId);
  if (schema?.encoding !== "protobuf") throw new Error(`${channel.topic}: schema is ${schema?.encoding}`);
  const root = protobuf.Root.fromDescriptor(FileDescriptorSet.decode(schema.data));
  root.resolveAll();
  types.set(channel.id, { topic: channel.topic, name: schema.name, type: root.lookupType(schema.name), count: 0, last: undefined });
}
for await (const message of reader.readMessages()) {
  const known = types.get(message.channelId);
  if (known === undefined) continue;
  if (message.logTime !== message.publishTime) throw new Error(`${known.topic}: two times`);
  known.last = known.type.decode(message.data);
  known.count += 1;
}

// Counts what a plot can show: numbers, also inside messages and lists.
function numbers(value) {
  if (typeof value === "number") return 1;
  if (protobuf.util.Long?.isLong(value)) return 1;
  if (Array.isArray(value)) return value.reduce((sum, element) => sum + numbers(element), 0);
  if (value instanceof protobuf.Message) {
    return value.$type.fieldsArray.reduce((sum, field) => sum + numbers(value[field.name]), 0);
  }
  return 0;
}
for (const { topic, name, count, last } of [...types.values()].sort((a, b) => (a.topic < b.topic ? -1 : 1))) {
  console.log(topic, name, count, numbers(last));
}
