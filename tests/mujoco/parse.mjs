// node parse.mjs TORSIO: MuJoCo 3 (npm's mujoco-js) loads what torsio export --mjcf writes, finds all names, and steps it. It has no
// callbacks: the spring of a model has no torque there, that of --linear-spring has the torque of the fallback.
import { strict as assert } from "node:assert";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import loadMujoco from "mujoco-js";

const torsio = resolve(process.argv[2]);
const folder = mkdtempSync(join(tmpdir(), "torsio-"));
const mujoco = await loadMujoco();

function run(...args) {
  execFileSync(torsio, args, { cwd: folder, stdio: ["ignore", "pipe", "pipe"] });
}

function load(file) {
  mujoco.FS.writeFile(`/${file}`, readFileSync(join(folder, file)));
  const model = mujoco.MjModel.loadFromXML(`/${file}`);
  assert(model, `${file}: not loaded`);
  return { model, data: new mujoco.MjData(model) };
}

/// The torque on the joint with the spring wound by 0.02 rad, and the angles after a second without a current.
function wind({ model, data }) {
  const sensor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR.value, "elbow_torque_Nm");
  assert(sensor >= 0, "no sensor elbow_torque_Nm");
  data.qpos[0] = 0.02;
  mujoco.mj_forward(model, data);
  const torque_Nm = data.sensordata[model.sensor_adr[sensor]];
  const steps = Math.round(1 / model.opt.timestep);
  for (let i = 0; i < steps; ++i) mujoco.mj_step(model, data);
  assert(Math.abs(data.time - 1) < 1e-9, `time ${data.time}`);
  assert([...data.qpos].every((angle) => Math.abs(angle) < 0.1), `angles ${[...data.qpos]}`);
  return torque_Nm;
}

try {
  run("simulate", "dfki-50", "sweep", "--duration", "30s", "-o", "sweep.csv");
  run("fit", "sweep.csv", "--model", "linear", "-o", "joint.safetensors");
  for (const actuator of ["dfki-28", "dfki-50", "dfki-120", "dfki-300", "elastomer", "rubber-clutch", "harmonic-drive"]) {
    const exported = ["export", "joint.safetensors", "--mjcf", "--actuator", actuator, "--overwrite", "-o", "elbow.xml"];
    run(...exported);
    const joint = load("elbow.xml");
    assert(joint.model.nuserdata > 0);
    mujoco.mj_forward(joint.model, joint.data);
    assert(joint.data.userdata.length === joint.model.nuserdata);
    assert(joint.model.nsensor === 6 && joint.model.nu === 2 && joint.model.ntendon === 1);
    if (actuator !== "dfki-50") continue;
    assert(wind(joint) === 0);
    run(...exported, "--linear-spring");
    const text = readFileSync(join(folder, "elbow.xml"), "utf8");
    const [offset, slope] = text.match(/biasprm="(\S+) (\S+) 0"/).slice(1).map(Number);
    const torque_Nm = wind(load("elbow.xml"));
    assert(Math.abs(torque_Nm - (offset - slope * 0.02)) < 1e-12, `${torque_Nm} Nm`);
    assert(torque_Nm > 5);
  }
  console.log(`MuJoCo ${mujoco.mj_versionString()}: the joints of 7 actuators load and run`);
} finally {
  rmSync(folder, { recursive: true, force: true });
}
