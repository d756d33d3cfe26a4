// What the page and `torsio connect page` exchange: subprotocol torsio.live.v1.

export const kSubprotocol = "torsio.live.v1";

export interface LiveJoint {
  id: number;
  name: string;
  actuator: string;
  /** Telemetry, then for each model `NAME: estimate` and `NAME: standard deviation`. */
  channels: string[];
  models: { name: string; target: string; on: boolean }[];
}

/** The first message. */
export interface Welcome {
  op: "joints";
  rate_Hz: number;
  /** The torque that is measured, where a joint has it. */
  reference: string;
  joints: LiveJoint[];
}

/** A few times each second. */
export interface Status {
  op: "status";
  recording: { files: string[]; duration_s: number } | null;
  /** Why the last recording was not begun, or has ended. */
  trouble: string;
  /** By joint: what is not a number. */
  joints: { state: string; monitor: string; silent: boolean; lost: number; models: boolean[] }[];
}

export interface Refusal {
  op: "refused";
  reason: string;
}

export type FromServer = Welcome | Status | Refusal;
export type ToServer = { op: "record"; on: boolean } | { op: "model"; joint: number; model: number; on: boolean };

export interface Block {
  joint: number;
  /** Number of the first sample since the program was started. */
  first: number;
  count: number;
  /** One channel after the other. */
  values: Float32Array;
}

const kHeaderBytes = 16;

/** Blocks of one message: u16 joint, u16 channels, u32 samples, f64 number of the first sample, f32 values; low byte first. */
export function blocks_of(message: ArrayBuffer): Block[] {
  const view = new DataView(message);
  const blocks: Block[] = [];
  for (let at = 0; at + kHeaderBytes <= message.byteLength; ) {
    const joint = view.getUint16(at, true);
    const channels = view.getUint16(at + 2, true);
    const count = view.getUint32(at + 4, true);
    const first = view.getFloat64(at + 8, true);
    at += kHeaderBytes;
    if (at + 4 * channels * count > message.byteLength) break;
    blocks.push({ joint, first, count, values: new Float32Array(message, at, channels * count) });
    at += 4 * channels * count;
  }
  return blocks;
}
