// The page of `torsio connect page`: what joints do now.
import "./report.css";
import "./live.css";
import { LiveJointView } from "./live_joint";
import { blocks_of, kSubprotocol } from "./live_messages";
import type { FromServer, Status, ToServer, Welcome } from "./live_messages";
import { add_theme_button } from "./theme";

const kRetry_ms = 2000;
const kWidths_s = [2, 5, 10, 30, 60];

function by_id<T extends HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

class LivePage {
  private socket: WebSocket | null = null;
  private joints: LiveJointView[] = [];
  private is_recording = false;
  private has_new_samples = false;
  private is_stopped = false;
  private pictures = 0;
  private drawing_ms = 0;
  private width_s = 10;

  constructor() {
    const width = by_id<HTMLSelectElement>("width");
    for (const width_s of kWidths_s) width.append(new Option(`${width_s} s`, String(width_s)));
    width.value = String(this.width_s);
    width.addEventListener("change", () => (this.width_s = Number(width.value)));
    const pause = by_id<HTMLButtonElement>("pause");
    pause.addEventListener("click", () => {
      this.is_stopped = !this.is_stopped;
      pause.setAttribute("aria-pressed", String(this.is_stopped));
    });
    by_id("record").addEventListener("click", () => this.send({ op: "record", on: !this.is_recording }));
    setInterval(() => this.count_pictures(), 1000);
    requestAnimationFrame(() => this.draw());
    this.connect();
  }

  private connect(): void {
    const token = new URLSearchParams(location.search).get("token") ?? "";
    const address = new URL("live", location.href);
    address.protocol = "ws:";
    address.search = `?token=${encodeURIComponent(token)}`;
    this.socket = new WebSocket(address, kSubprotocol);
    this.socket.binaryType = "arraybuffer";
    let reason = "";
    this.socket.addEventListener("message", ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (data instanceof ArrayBuffer) return this.take_samples(data);
      const message = JSON.parse(data) as FromServer;
      if (message.op === "joints") this.welcome(message);
      else if (message.op === "status") this.show_status(message);
      else reason = message.reason;
    });
    this.socket.addEventListener("close", (event) => {
      by_id<HTMLButtonElement>("record").disabled = true;
      this.say(`Not connected: ${reason || event.reason || "the program has ended, or it refused the token or this page"}.`);
      // A refusal stays one.
      if (!reason) setTimeout(() => this.connect(), kRetry_ms);
    });
  }

  private send(message: ToServer): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  private say(text: string): void {
    by_id("connection").textContent = text;
  }

  private welcome({ rate_Hz, joints, reference }: Welcome): void {
    const place = by_id("joints");
    place.replaceChildren();
    this.joints = joints.map((joint, i) => {
      const section = document.createElement("section");
      place.append(section);
      const switch_model = (model: number, on: boolean) => this.send({ op: "model", joint: i, model, on });
      return new LiveJointView(section, joint, rate_Hz, joint.channels.includes(reference) ? reference : null, switch_model);
    });
    by_id<HTMLButtonElement>("record").disabled = false;
    this.say(`Connected: ${joints.length === 1 ? "one joint" : `${joints.length} joints`} at ${rate_Hz} Hz.`);
  }

  private take_samples(message: ArrayBuffer): void {
    for (const { joint, first, count, values } of blocks_of(message)) this.joints[joint]?.add(first, count, values);
    this.has_new_samples = true;
  }

  private show_status({ recording, trouble, joints }: Status): void {
    this.is_recording = recording !== null;
    const button = by_id<HTMLButtonElement>("record");
    button.setAttribute("aria-pressed", String(this.is_recording));
    button.textContent = this.is_recording ? "End the recording" : "Record";
    if (trouble) by_id("recording").textContent = trouble;
    else if (recording)
      by_id("recording").textContent = `${recording.duration_s.toFixed(1)} s in ${recording.files.join(", ")}`;
    joints.forEach((status, i) => this.joints[i]?.show_status(status));
  }

  private draw(): void {
    requestAnimationFrame(() => this.draw());
    if (this.is_stopped || !this.has_new_samples) return;
    this.has_new_samples = false;
    this.pictures += 1;
    const begin_ms = performance.now();
    for (const joint of this.joints) joint.draw(this.width_s);
    this.drawing_ms += performance.now() - begin_ms;
  }

  private count_pictures(): void {
    by_id("pictures").textContent = `${this.pictures} pictures a second`;
    document.body.dataset.pictures = String(this.pictures);
    document.body.dataset.drawing = (this.drawing_ms / Math.max(this.pictures, 1)).toFixed(1);
    this.pictures = 0;
    this.drawing_ms = 0;
  }
}

add_theme_button();
new LivePage();
