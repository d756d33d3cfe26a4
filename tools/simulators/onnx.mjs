// Steps an ONNX estimator with onnxruntime-node over the rows of `torsio estimate -o` and compares.
//   node onnx.mjs MODEL.onnx ESTIMATES.csv [ROWS]
// Prints JSON: the largest difference of value and error bar as a share of the value's range, other faults, the time of a step,
// and whether 64 joints in a batch give what they give alone.
import fs from 'node:fs';
import { createRequire } from 'node:module';

const require = createRequire(import.meta.url);
const ort = require('onnxruntime-node');

const [file, estimates, most] = process.argv.slice(2);
const [header, ...lines] = fs.readFileSync(estimates, 'utf8').trim().split('\n');
const columns = header.split(',');
const rows = lines.slice(0, most === undefined ? lines.length : Number(most)).map((line) => line.split(','));

const session = await ort.InferenceSession.create(file, { intraOpNumThreads: 1, interOpNumThreads: 1 });
const metadata = JSON.parse(fs.readFileSync(`${file}.json`, 'utf8'));
const inputs = metadata.inputs;
const isDouble = metadata.real === 'double';
const Numbers = isDouble ? Float64Array : Float32Array;
const type = isDouble ? 'float64' : 'float32';
const at = (name) => {
  const index = columns.indexOf(name);
  if (index < 0) throw new Error(`${estimates} has no column ${name}: ${header}`);
  return index;
};
const value = columns.findIndex((name) => name.startsWith('estimated_'));
const stdDev = columns.findIndex((name) => name.includes('_std_dev_'));
const fault = at('fault');
const raw = inputs.map(at);
const faults = metadata.faults;

const tensor = (data, width) => new ort.Tensor(type, data, [data.length / width, width]);

async function step(feeds) {
  const out = await session.run(feeds);
  return { value: out.value.data, stdDev: out.std_dev.data, fault: out.fault.data, state: out.next_state };
}

const width = metadata.state_width;
const feedsOf = (data, state) => {
  const feeds = { inputs: tensor(data, inputs.length) };
  if (width > 0) feeds.state = state;
  if (session.inputNames.includes('timestep_s')) feeds.timestep_s = tensor(Numbers.of(1 / metadata.sample_rate_Hz), 1);
  return feeds;
};
const zeroState = (joints) => (width > 0 ? tensor(new Numbers(joints * width), width) : undefined);

let state = zeroState(1);
let [lowest, highest, worst, worstStdDev, otherFaults, used] = [0, 0, 0, 0, 0, 0];
const begin = process.hrtime.bigint();
for (const row of rows) {
  const out = await step(feedsOf(Numbers.from(raw.map((i) => (row[i] === '' ? NaN : Number(row[i])))), state));
  state = out.state;
  const expected = Number(row[value]);
  lowest = Math.min(lowest, expected);
  highest = Math.max(highest, expected);
  worst = Math.max(worst, Math.abs(out.value[0] - expected));
  const own = row[stdDev] === '' ? NaN : Number(row[stdDev]);
  if (Number.isNaN(own) !== Number.isNaN(out.stdDev[0])) otherFaults += 1;
  else if (!Number.isNaN(own)) worstStdDev = Math.max(worstStdDev, Math.abs(out.stdDev[0] - own));
  if (faults[out.fault[0]] !== row[fault]) otherFaults += 1;
  else if (out.fault[0] === 0) used += 1;
}
const stepUs = Number(process.hrtime.bigint() - begin) / 1000 / rows.length;

// 64 joints, each a few ticks later than the one before.
const joints = 64;
const ticks = 200;
const alone = [];
for (let joint = 0; joint < joints; ++joint) {
  let own = zeroState(1);
  let last = 0;
  for (let n = 0; n < ticks; ++n) {
    const out = await step(feedsOf(Numbers.from(raw.map((i) => Number(rows[7 * joint + n][i]))), own));
    own = out.state;
    last = out.value[0];
  }
  alone.push(last);
}
let together = zeroState(joints);
let values = [];
for (let n = 0; n < ticks; ++n) {
  const data = new Numbers(joints * inputs.length);
  for (let joint = 0; joint < joints; ++joint)
    raw.forEach((i, k) => (data[joint * inputs.length + k] = Number(rows[7 * joint + n][i])));
  const out = await step(feedsOf(data, together));
  together = out.state;
  values = out.value;
}
const apart = Math.max(...alone.map((own, joint) => Math.abs(own - values[joint])));

const range = highest - lowest;
console.log(
  JSON.stringify({
    rows: rows.length,
    used,
    value: worst / range,
    std_dev: worstStdDev / range,
    other_faults: otherFaults,
    batch: apart / range,
    step_us: stepUs,
  }),
);
