/** The socket beside a 3D frame: tells what it shall show, hears which servo was clicked in it. */
import { ROOT } from "../api/root";
import type { Quality } from "./view-url";

/** One servo at an instant, for a frame that shows a recording. Degrees; null is "not known". */
export interface ViewPose {
  uid: string;
  series: "BLA21" | "BLA15" | "BLA34" | "";
  angle: number | null;
  command: number | null;
  limit_cw: number | null;
  limit_ccw: number | null;
  /** Nothing was heard of it then. */
  stale: boolean;
}

/** What a frame shows; every wish is whole. As hornbill/view/wish.py reads it. */
export interface ViewWish {
  select: string | null;
  theme: "light" | "dark";
  quality: Quality;
  looking: boolean;
  wall?: { columns: number; scale: number; uids: readonly string[] } | null;
  poses?: readonly ViewPose[] | null;
  resets?: number;
}

const AGAIN_MS = 2000;

export class ViewLink {
  readonly key: string;
  #onPick: (uid: string) => void;
  #socket: WebSocket | null = null;
  #again: ReturnType<typeof setTimeout> | undefined;
  #wish: string | null = null;
  #said: string | null = null;
  #over = false;

  constructor(key: string, onPick: (uid: string) => void) {
    this.key = key;
    this.#onPick = onPick;
  }

  /** Connects, anew if it was connected. It comes back by itself until `close`. */
  open(): void {
    this.#drop();
    this.#over = false;
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}${ROOT}/viser/${this.key}/wish`);
    this.#socket = socket;
    socket.onopen = () => this.#say();
    socket.onmessage = event => {
      const message = JSON.parse(String(event.data)) as { picked?: unknown };
      if (typeof message.picked === "string") this.#onPick(message.picked);
    };
    socket.onclose = () => {
      if (socket !== this.#socket || this.#over) return;
      this.#again = setTimeout(() => this.open(), AGAIN_MS);
    };
  }

  tell(wish: ViewWish): void {
    this.#wish = JSON.stringify(wish);
    this.#say();
  }

  close(): void {
    this.#over = true;
    this.#drop();
  }

  #say(): void {
    if (this.#socket?.readyState !== WebSocket.OPEN) return;
    if (this.#wish === null || this.#wish === this.#said) return;
    this.#said = this.#wish;
    this.#socket.send(this.#wish);
  }

  #drop(): void {
    clearTimeout(this.#again);
    this.#said = null;
    const old = this.#socket;
    this.#socket = null;
    // Closed while it connects, a socket is an error in the browser's console: it opens first.
    if (old === null) return;
    if (old.readyState === WebSocket.CONNECTING) old.onopen = () => old.close();
    else old.close();
  }
}
