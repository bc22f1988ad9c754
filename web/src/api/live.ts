/** The WebSocket: reconnects, subscribes again, detects silence, and dispatches messages. */
import type { ClientMessage, ServerMessage } from "./types";

export type LinkState = "connecting" | "up" | "down";

/** The part of WebSocket in use, so that tests can replace it. */
export interface Socket {
  readonly readyState: number;
  onopen: ((event: Event) => void) | null;
  onclose: ((event: CloseEvent) => void) | null;
  onmessage: ((event: MessageEvent) => void) | null;
  send(text: string): void;
  close(): void;
}

export interface LiveOptions {
  open: () => Socket;
  onMessage: (message: ServerMessage) => void;
  onState: (state: LinkState) => void;
  /** Messages sent after every (re)connection. */
  greeting: () => ClientMessage[];
}

const OPEN = 1;
const FIRST_RETRY_MS = 250;
const LAST_RETRY_MS = 2000;
/** After this time without a message, the client requests one: the server responds to any subscription. */
const PING_MS = 700;
/** The link is down after this time without a message. */
export const SILENCE_MS = 1700;
/** A busy server may need this long to accept a socket and send the first message: retries would only add to its work. */
export const CONNECT_MS = 8000;
const WATCH_MS = 200;
/** If the check runs later than this, the page was suspended, and so were the messages of the server. */
const LATE_MS = 2 * WATCH_MS;
const LISTEN_MS = 50;

export class Live {
  #socket: Socket | null = null;
  #state: LinkState = "connecting";
  #retry_ms = FIRST_RETRY_MS;
  #retry: ReturnType<typeof setTimeout> | undefined;
  #watch: ReturnType<typeof setInterval> | undefined;
  #received = 0;
  #requested = 0;
  #looked = 0;
  #options: LiveOptions;

  constructor(options: LiveOptions) {
    this.#options = options;
  }

  get state(): LinkState {
    return this.#state;
  }

  start(): void {
    this.#connect();
    this.#looked = performance.now();
    this.#watch = setInterval(() => this.#look(), WATCH_MS);
  }

  stop(): void {
    clearInterval(this.#watch);
    clearTimeout(this.#retry);
    this.#drop();
  }

  /** Send now or not at all. Nothing is queued: a late command is a wrong one. */
  send(message: ClientMessage): boolean {
    if (this.#socket?.readyState !== OPEN) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  /** Retry immediately, for example when the tab becomes visible. */
  hurry(): void {
    if (this.#socket !== null) return;
    clearTimeout(this.#retry);
    this.#connect();
  }

  #connect(): void {
    const socket = this.#options.open();
    this.#socket = socket;
    this.#received = performance.now();
    socket.onopen = () => {
      if (socket !== this.#socket) return;
      this.#received = performance.now();
      for (const message of this.#options.greeting()) this.send(message);
    };
    socket.onmessage = event => {
      if (socket !== this.#socket) return;
      this.#received = performance.now();
      // Up only after the first message: a proxy may accept a socket without a server.
      this.#retry_ms = FIRST_RETRY_MS;
      this.#change("up");
      const message = read(event.data);
      if (message) this.#options.onMessage(message);
    };
    socket.onclose = () => {
      if (socket === this.#socket) this.#lost();
    };
  }

  #look(): void {
    const now = performance.now();
    const heldUp = now - this.#looked > LATE_MS;
    this.#looked = now;
    // The page was suspended, not the server silent: read the waiting messages first.
    if (heldUp) setTimeout(() => this.#judge(), LISTEN_MS);
    else this.#judge();
  }

  #judge(): void {
    if (this.#socket === null) return;
    const now = performance.now();
    if (now - this.#received > (this.#state === "up" ? SILENCE_MS : CONNECT_MS)) this.#lost();
    else if (now - Math.max(this.#received, this.#requested) > PING_MS) {
      this.#requested = now;
      this.send({ type: "subscribe", topics: ["bus"], uids: null, frames: null });
    }
  }

  #lost(): void {
    this.#drop();
    this.#change("down");
    this.#retry = setTimeout(() => this.#connect(), this.#retry_ms);
    this.#retry_ms = Math.min(LAST_RETRY_MS, this.#retry_ms * 2);
  }

  #drop(): void {
    const socket = this.#socket;
    this.#socket = null;
    if (socket) {
      socket.onopen = socket.onclose = socket.onmessage = null;
      socket.close();
    }
  }

  #change(state: LinkState): void {
    if (state === this.#state) return;
    this.#state = state;
    this.#options.onState(state);
  }
}

function read(data: unknown): ServerMessage | null {
  try {
    const message = JSON.parse(String(data)) as ServerMessage;
    return typeof message.type === "string" ? message : null;
  } catch {
    return null;
  }
}
