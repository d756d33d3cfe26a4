// node read_published.mjs TORSIO: Foxglove's own client (npm's @foxglove/ws-protocol) with both subprotocols and a reader of
// PlotJuggler's datagrams read twelve joints for one second at the same time, while one joint is recorded. Every number must be the
// same double in all of them.
import { strict as assert } from "node:assert";
import { spawn } from "node:child_process";
import { createSocket } from "node:dgram";
import { once } from "node:events";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { createInterface } from "node:readline";
import { setTimeout as sleep } from "node:timers/promises";
import { Worker, isMainThread, parentPort, workerData } from "node:worker_threads";
import protocol from "@foxglove/ws-protocol";
import { WebSocket } from "ws";

const torsio = isMainThread ? resolve(process.argv[2]) : "";
const joints = 12;
const read_s = 1;
const folder = isMainThread ? mkdtempSync(join(tmpdir(), "torsio-")) : "";
const children = [];

async function freePort() {
  const socket = createSocket("udp4");
  socket.bind(0, "127.0.0.1");
  await once(socket, "listening");
  const { port } = socket.address();
  socket.close();
  await once(socket, "close");
  return port;
}

function start(...arguments_) {
  const child = spawn(torsio, arguments_.map(String), { stdio: ["ignore", "pipe", "pipe"] });
  child.errors = "";
  child.stderr.on("data", (text) => (child.errors += text));
  child.stdout.resume();
  child.ended = once(child, "exit");
  children.push(child);
  return child;
}

/// What a client of Foxglove reads: values by topic and time in microseconds.
class FoxgloveReader {
  constructor(port, subprotocol) {
    this.values = new Map();
    this.statuses = [];
    this.topics = new Map();
    this.client = new protocol.FoxgloveClient({ ws: new WebSocket(`ws://localhost:${port}`, [subprotocol]) });
    this.client.on("error", (error) => assert.fail(error));
    this.client.on("status", (status) => this.statuses.push(status));
    this.client.on("serverInfo", (info) => (this.info = info));
    this.client.on("advertise", (channels) => {
      for (const channel of channels) {
        assert.equal(channel.encoding, "json");
        assert.equal(JSON.parse(channel.schema).type, "object");
        this.topics.set(this.client.subscribe(channel.id), channel.topic);
      }
    });
    this.client.on("message", ({ subscriptionId, timestamp, data }) => {
      assert.equal(timestamp % 1000n, 0n);
      this.values.set(`${this.topics.get(subscriptionId)} ${timestamp / 1000n}`, data);
    });
  }
}

/// Reads datagrams in a thread of its own, which does nothing else until it is asked for them.
class PlotJugglerReader {
  static async begin(port) {
    const reader = new PlotJugglerReader();
    reader.worker = new Worker(new URL(import.meta.url), { workerData: { port } });
    await once(reader.worker, "message");
    return reader;
  }
  /// Values by topic and time in microseconds.
  async end() {
    this.worker.postMessage("end");
    const [datagrams] = await once(this.worker, "message");
    const values = new Map();
    for (const each of datagrams) {
      const { timestamp, ...rest } = JSON.parse(Buffer.from(each).toString());
      const [[name, found]] = Object.entries(rest);
      values.set(`/${name} ${Math.round(1e6 * timestamp)}`, found);
    }
    return values;
  }
  static serve(port) {
    const datagrams = [];
    const receiver = createSocket({ type: "udp4", recvBufferSize: 1 << 22 });
    receiver.on("message", (datagram) => datagrams.push(datagram));
    receiver.bind(port, "127.0.0.1", () => parentPort.postMessage("ready"));
    parentPort.once("message", () => {
      receiver.close();
      parentPort.postMessage(datagrams);
    });
  }
}

function compare(one, other) {
  let numbers = 0;
  for (const [name, value] of Object.entries(one)) {
    assert.ok(Object.is(value, other[name]), `${name}: ${value} and ${other[name]}`);
    numbers += 1;
  }
  assert.equal(numbers, Object.keys(other).length);
  return numbers;
}

async function main() {
  const [port, host, otherHost, plotjuggler, foxglove] = await Promise.all([...Array(5)].map(freePort));
  start("joint", ...Array(joints).fill("dfki-50"), "--port", port, "--host-port", host,
        "--allow", `127.0.0.1:${host}`, "--allow", `127.0.0.1:${otherHost}`);
  const receiver = await PlotJugglerReader.begin(plotjuggler);
  const publish = start("connect", "publish", "--port", port, "--host-port", host, "--timeout", "1s",
                        "--joints", `1-${joints}`, "--plotjuggler", `127.0.0.1:${plotjuggler}`, "--foxglove", foxglove,
                        "--json", join(folder, "sent.json"));
  for await (const line of createInterface({ input: publish.stderr }))
    if (line.startsWith("Foxglove")) break;
  const readers = ["foxglove.websocket.v1", "foxglove.sdk.v1"].map((name) => new FoxgloveReader(foxglove, name));
  while (readers.some((each) => each.values.size === 0)) await sleep(5);
  const record = start("connect", "record", "--port", port, "--host-port", otherHost, "--id", 200, "--timeout", "1s",
                       "--joint", 5, "--for", "0.8s", "-o", join(folder, "joint5.csv"));
  await Promise.all([record.ended, sleep(1000 * read_s)]);
  for (const each of readers) each.client.getParameters(["a"]);
  while (readers.some((each) => each.statuses.length === 0)) await sleep(5);
  publish.kill("SIGINT");
  await publish.ended;
  const plotted = await receiver.end();
  const decoder = new TextDecoder();
  for (const each of readers)
    for (const [key, data] of each.values) each.values.set(key, JSON.parse(decoder.decode(data)));
  assert.equal(publish.exitCode, 0, publish.errors);
  assert.equal(record.exitCode, 0, record.errors);

  let numbers = 0;
  for (const each of readers) {
    assert.equal(each.info.op, "serverInfo");
    assert.match(each.statuses[0].message, /getParameters: not offered/);
    assert.equal(each.topics.size, joints);
    let common = 0;
    for (const [key, values] of each.values) {
      if (!plotted.has(key)) continue; // a lost datagram
      numbers += compare(values, plotted.get(key));
      common += 1;
    }
    console.log(`${each.values.size} samples by WebSocket, ${common} of them by UDP as well`);
    assert.ok(common > 0.5 * each.values.size);
    assert.ok(common > 0.5 * 1000 * read_s * joints);
  }
  const [header, ...lines] = readFileSync(join(folder, "joint5.csv"), "utf8").trim().split("\n");
  const names = header.split(",").slice(1);
  const rows = new Map(lines.map((line, n) => [line.split(",").slice(1).map((text) =>
    text === "nan" ? undefined : Number(text)).join(), n]));
  const topic = [...readers[0].topics.values()][4];
  const shifts = new Set();
  let recorded = 0;
  for (const [key, values] of readers[1].values) {
    if (!key.startsWith(`${topic} `)) continue;
    const row = rows.get(names.map((name) => values[name]).join());
    if (row === undefined) continue;
    recorded += 1;
    shifts.add(Math.round(Number(key.split(" ")[1]) / 1000) - row);
  }
  console.log(`${recorded} of ${lines.length} recorded samples are among them, ${numbers} numbers are the same`);
  assert.ok(recorded > 0.5 * lines.length);
  assert.ok(Math.max(...shifts) - Math.min(...shifts) <= 1); // rounding of a late cycle
  const sent = JSON.parse(readFileSync(join(folder, "sent.json"), "utf8"));
  assert.equal(sent.clients, 2);
  assert.equal(sent.dropped, 0);
  console.log(`published: ${JSON.stringify({ ...sent, joints: sent.joints.length })}`);
}

if (!isMainThread) {
  PlotJugglerReader.serve(workerData.port);
} else {
  try {
    await main();
  } finally {
    for (const child of children) child.kill("SIGINT");
    await Promise.all(children.map((child) => child.ended));
    rmSync(folder, { recursive: true });
  }
  process.exit(0); // the sockets of the clients are still closing
}
