// Writes the recordings of tests/data/mcap with the reference implementation of MCAP and a CDR writer for ROS 2:
//   npm install && node make_mcap.mjs ../../tests/data/mcap
// Two joints at 200 Hz whose order changes, a load cell at 50 Hz, a temperature at 10 Hz, and a status in JSON. The
// numbers are functions of the number of the message, which the tests know.
import {writeFileSync} from "node:fs";
import {McapWriter} from "@mcap/core";
import {parse} from "@foxglove/rosmsg";
import {MessageWriter} from "@foxglove/rosmsg2-serialization";
import zstd from "@foxglove/wasm-zstd";
import lz4 from "lz4js";

const line = "=".repeat(80);
const header = `${line}
MSG: std_msgs/Header
# time and frame
builtin_interfaces/Time stamp
string frame_id
${line}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
`;
const schemas = {
  "sensor_msgs/msg/JointState": `std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
${header}`,
  "geometry_msgs/msg/WrenchStamped": `# a force and a torque
std_msgs/Header header
Wrench wrench
${line}
MSG: geometry_msgs/Wrench
Vector3  force
Vector3  torque
${line}
MSG: geometry_msgs/Vector3
float64 x
float64 y 0.0   # with a default
float64 z
${header}`,
  "sensor_msgs/msg/Temperature": `uint8 UNKNOWN=0
std_msgs/Header header
float64 temperature
float64 variance
float32[3] others
uint8[] raw
string<=8 unit
${header}`,
};

class Memory {
  parts = [];
  size = 0n;
  position() { return this.size; }
  async write(bytes) { this.parts.push(bytes.slice()); this.size += BigInt(bytes.byteLength); }
  bytes() { return Buffer.concat(this.parts); }
}

const start = 1_700_000_000_000_000_000n;  // ns
const stamp = (time) => ({sec: Number(time / 1_000_000_000n), nanosec: Number(time % 1_000_000_000n)});

async function recording({packing, chunks = true, count = 200}) {
  const memory = new Memory();
  const compress = {zstd: (bytes) => zstd.compress(bytes), lz4: (bytes) => lz4.compress(bytes)}[packing];
  const writer = new McapWriter({
    writable: memory,
    useChunks: chunks,
    chunkSize: 16 * 1024,
    ...(compress && {compressChunk: (bytes) => ({compression: packing, compressedData: compress(bytes)})}),
  });
  await writer.start({profile: "ros2", library: "torsio tests"});
  const channel = async (topic, schema) => {
    const schemaId = await writer.registerSchema(
      {name: schema, encoding: "ros2msg", data: Buffer.from(schemas[schema])});
    const id = await writer.registerChannel({topic, schemaId, messageEncoding: "cdr", metadata: new Map()});
    const cdr = new MessageWriter(parse(schemas[schema], {ros2: true}));
    return async (sequence, time, message) => writer.addMessage({
      channelId: id, sequence, logTime: time + 300_000n, publishTime: time, data: cdr.writeMessage(message)});
  };
  const joints = await channel("/joint_states", "sensor_msgs/msg/JointState");
  const cell = await channel("/load_cell", "geometry_msgs/msg/WrenchStamped");
  const temperature = await channel("/motor/temperature", "sensor_msgs/msg/Temperature");
  const status = await writer.registerChannel(
    {topic: "/status", schemaId: 0, messageEncoding: "json", metadata: new Map()});
  for (let n = 0; n < count; ++n) {
    const time = start + BigInt(n) * 5_000_000n;
    const common = (at) => ({header: {stamp: stamp(at), frame_id: "base"}});
    const names = n < count / 2 ? ["shoulder", "elbow"] : ["elbow", "shoulder"];
    const of = (name) => (name === "elbow" ? 1 : 10) * Math.sin(0.05 * n);
    await joints(n, time, {...common(time), name: names, position: names.map(of), velocity: [],
                           effort: names.map((name) => 2 * of(name))});
    if (n % 4 === 2) {
      const later = time + 1_000_000n;
      await cell(n, later, {...common(later), wrench: {force: {x: n, y: 0, z: 0}, torque: {x: 0, y: 0, z: 0.5 * n}}});
    }
    if (n % 20 === 0)
      await temperature(n, time, {...common(time), temperature: 25 + 0.01 * n, variance: 0, others: [1, 2, 3],
                                  raw: new Uint8Array([1, 2, 3]), unit: "degC"});
    if (n % 100 === 0)
      await writer.addMessage({channelId: status, sequence: n, logTime: time, publishTime: time,
                               data: Buffer.from(JSON.stringify({armed: n > 100, current: {A: 0.1 * n}, text: "on"}))});
  }
  await writer.end();
  return memory.bytes();
}

const folder = process.argv[2] ?? ".";
await new Promise((resolve) => zstd.isLoaded.then(resolve));
const plain = await recording({packing: "", chunks: false});
writeFileSync(`${folder}/no_chunks.mcap`, plain);
writeFileSync(`${folder}/zstd.mcap`, await recording({packing: "zstd"}));
writeFileSync(`${folder}/lz4.mcap`, await recording({packing: "lz4"}));
