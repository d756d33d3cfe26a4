// Runs a program as WebAssembly over inputs.bin: its self-test must pass, and each number equal that of the host's program.
// node run_wasm.mjs FOLDER TOLERANCE
import { readFileSync } from 'node:fs';

const [folder, tolerance] = process.argv.slice(2);
const doubles = (name) => new Float64Array(new Uint8Array(readFileSync(`${folder}/${name}`)).buffer);
const { instance } = await WebAssembly.instantiate(readFileSync(`${folder}/joint.wasm`));
const { memory, row, estimate, step, self_test: selfTest } = instance.exports;

const apart = selfTest();
if (!(apart < Number(tolerance))) throw new Error(`the self-test is ${apart} off`);

const inputs = doubles('inputs.bin');
const expected = doubles('outputs.bin');
const ticks = expected.length / 3;
const width = inputs.length / ticks;
const from = new Float64Array(memory.buffer, row(), width);
const to = new Float64Array(memory.buffer, estimate(), 3);
for (let tick = 0; tick < ticks; ++tick) {
  from.set(inputs.subarray(tick * width, (tick + 1) * width));
  step();
  for (let i = 0; i < 3; ++i)
    if (!Object.is(to[i], expected[3 * tick + i]))
      throw new Error(`tick ${tick}: ${to[i]} instead of ${expected[3 * tick + i]}`);
}
console.log(`self-test ${apart.toPrecision(3)}, ${ticks} ticks equal`);
