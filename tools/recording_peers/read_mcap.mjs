// node read_mcap.mjs RUN.mcap [RUN.csv]: reads what torsio wrote with the reference implementation of MCAP: by its
// index and as a stream, with all checksums. With RUN.csv every number must be equal; without it prints MB/s of
// messages that were decoded.
import {readFileSync} from "node:fs";
import {McapIndexedReader, McapStreamReader} from "@mcap/core";
import {parse} from "@foxglove/rosmsg";
import {MessageReader} from "@foxglove/rosmsg2-serialization";
import {ZstdDecoder} from "./zstd.mjs";

const [path, csv] = process.argv.slice(2);
const bytes = readFileSync(path);
const zstd = await ZstdDecoder();
const decompressHandlers = {zstd: (packed, size) => zstd(packed, Number(size))};
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, length) => new Uint8Array(bytes.buffer, bytes.byteOffset + Number(offset), Number(length)),
};

async function decodeAll(take) {
  const file = await McapIndexedReader.Initialize({readable, decompressHandlers});
  const readers = new Map(), columns = new Map();
  for (const channel of file.channelsById.values()) {
    const schema = file.schemasById.get(channel.schemaId);
    const definition = new TextDecoder().decode(schema.data);
    readers.set(channel.id, new MessageReader(parse(definition, {ros2: true})));
    for (const [, field, column] of definition.matchAll(/^\S+ (\w+)  # (.*)$/gm)) columns.set(column, field);
  }
  let size = 0;
  for await (const message of file.readMessages()) {
    size += message.data.byteLength;
    take(readers.get(message.channelId).readMessage(message.data), columns);
  }
  return {size, columns, statistics: file.statistics};
}

if (!csv) {
  let best = Infinity, size = 0;
  for (let i = 0; i < 3; ++i) {
    const start = performance.now();
    ({size} = await decodeAll(() => {}));
    best = Math.min(best, performance.now() - start);
  }
  console.log((size / best * 1e-3).toFixed(1));
} else {
  const [header, ...lines] = readFileSync(csv, "utf8").trimEnd().split("\n");
  const names = header.split(",");
  let row = 0;
  const {statistics} = await decodeAll((message, columns) => {
    const cells = lines[row++].split(",");
    names.forEach((name, i) => {
      const expected = cells[i] === "" || cells[i] === "nan" ? NaN : Number(cells[i]);
      const found = message[columns.get(name)];
      if (!Object.is(found, expected)) throw new Error(`row ${row}: ${name} is ${found}, not ${cells[i]}`);
    });
  });
  const stream = new McapStreamReader({validateCrcs: true, decompressHandlers});
  stream.append(bytes);
  let streamed = 0;
  for (let record; (record = stream.nextRecord());) streamed += record.type === "Message";
  if (row !== lines.length || streamed !== row || statistics.messageCount !== BigInt(row))
    throw new Error(`${row} messages by the index, ${streamed} in the stream, ${lines.length} rows`);
  console.log(`${path}: ${row} messages are equal to ${csv}`);
}
