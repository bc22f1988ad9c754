/** The socket of a 3D frame: sends what to show, receives clicks and its pose. */
import { ROOT } from "../api/root";
import type { Quality } from "./view-url";

/** One servo at an instant, for a frame that shows a recording. Degrees; null is unknown. */
export interface ViewPose {
  uid: string;
  series: "BLA21" | "BLA15" | "BLA34" | "";
  angle: number | null;
  command: number | null;
  limit_cw: number | null;
  limit_ccw: number | null;
  /** No data at that time. */
  stale: boolean;
}

/** Content of a frame; every request is complete. Read by hornbill/view/view_settings.py. */
export interface ViewRequest {
  select: string | null;
  theme: "light" | "dark";
  quality: Quality;
  visible: boolean;
  wall?: { columns: number; scale: number; uids: readonly string[] } | null;
  poses?: readonly ViewPose[] | null;
  resets?: number;
  /** Close view: the servo in front without the others. */
  alone?: boolean;
}

type Vector = readonly [number, number, number];

/** A servo in the scene: the foot of its shaft, its bounding box, and the disc its horn sweeps. */
export interface Stand {
  uid: string;
  at: Vector;
  low: Vector;
  high: Vector;
  height: number;
  reach: number;
}

/** Camera and servos in view, the selected one first, as sent by hornbill/view/projection.py. */
export interface Sight {
  eye: Vector;
  right: Vector;
  down: Vector;
  ahead: Vector;
  fov: number;
  servos: readonly Stand[];
}

const AGAIN_MS = 2000;

export class ViewLink {
  readonly key: string;
  #onPick: (uid: string) => void;
  #onSight: (sight: Sight | null) => void;
  #socket: WebSocket | null = null;
  #again: ReturnType<typeof setTimeout> | undefined;
  #request: string | null = null;
  #sent: string | null = null;
  #over = false;

  constructor(
    key: string,
    onPick: (uid: string) => void,
    onSight: (sight: Sight | null) => void = () => undefined,
  ) {
    this.key = key;
    this.#onPick = onPick;
    this.#onSight = onSight;
  }

  /** Connect or reconnect. Reconnects automatically until `close`. */
  open(): void {
    this.#drop();
    this.#over = false;
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}${ROOT}/viser/${this.key}/settings`);
    this.#socket = socket;
    socket.onopen = () => this.#say();
    socket.onmessage = event => {
      const message = JSON.parse(String(event.data)) as { picked?: unknown; projection?: Sight };
      if (typeof message.picked === "string") this.#onPick(message.picked);
      if (message.projection) this.#onSight(message.projection);
    };
    socket.onclose = () => {
      if (socket !== this.#socket || this.#over) return;
      this.#again = setTimeout(() => this.open(), AGAIN_MS);
    };
  }

  send(request: ViewRequest): void {
    this.#request = JSON.stringify(request);
    this.#say();
  }

  close(): void {
    this.#over = true;
    this.#drop();
  }

  #say(): void {
    if (this.#socket?.readyState !== WebSocket.OPEN) return;
    if (this.#request === null || this.#request === this.#sent) return;
    this.#sent = this.#request;
    this.#socket.send(this.#request);
  }

  #drop(): void {
    clearTimeout(this.#again);
    this.#sent = null;
    this.#onSight(null);
    const old = this.#socket;
    this.#socket = null;
    // Closing a connecting socket logs an error in the console: let it open first.
    if (old === null) return;
    if (old.readyState === WebSocket.CONNECTING) old.onopen = () => old.close();
    else old.close();
  }
}
