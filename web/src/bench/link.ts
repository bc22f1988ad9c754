/** The connection to the server: requests after a reconnect, and dispatch of messages. */
import { batch, computed, signal } from "@preact/signals";
import { API, callApi } from "../api/client";
import { type LinkState, Live } from "../api/live";
import type { ClientMessage, Params, ServerMessage } from "../api/types";
import { telemetry } from "../telemetry/store";
import { addEvent, bus, setLeases, stop } from "./bench";
import { loadCatalog } from "./catalog";
import { monotonic } from "./clock";
import * as fleet from "./fleet";
import { setJob } from "./jobs";
import { takeReading } from "./parameters";
import { look, onSignIn } from "./session";
import { takeStaleAfter } from "./staleness";

export interface Link {
  state: LinkState;
  /** Start of this state, monotonic. */
  since: number;
}

export const link = signal<Link>({ state: "connecting", since: monotonic() });

/** Controls are enabled: false as soon as the socket is lost. */
export const up = computed(() => link.value.state === "up");

/** Counts connections; a change means that everything was requested again. */
export const connection = signal(0);

export const version = signal("");
export const demo = signal(false);

type ErrorMessage = Extract<ServerMessage, { type: "error" }>;
const refusals = new Set<(error: ErrorMessage) => void>();

/** Called when a request over the socket failed. */
export function onRefusal(act: (error: ErrorMessage) => void): () => void {
  refusals.add(act);
  return () => refusals.delete(act);
}

const hearers = new Set<() => void>();

/** Called with every message first. */
export function onAnyMessage(act: () => void): () => void {
  hearers.add(act);
  return () => hearers.delete(act);
}

type FramesMessage = Extract<ServerMessage, { type: "frames" }>;
const monitors = new Set<(message: FramesMessage) => void>();

/** Called with bus messages, while subscribed. */
export function onFrames(act: (message: FramesMessage) => void): () => void {
  monitors.add(act);
  return () => monitors.delete(act);
}

const greeting = (): ClientMessage[] => [
  { type: "subscribe", topics: ["servos", "telemetry", "events", "jobs", "bus"], uids: null, frames: null },
];

const address = () => `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${API}/ws`;

export const live = new Live({
  open: () => new WebSocket(address()),
  greeting,
  onMessage: receive,
  onState: state => {
    link.value = { state, since: monotonic() };
    // The browser gives the page no reason why a socket was refused.
    if (state === "down") void look();
    // In a batch, so that the requests of the page follow those for the list.
    if (state === "up") {
      batch(() => {
        connection.value += 1;
        void refetch();
      });
    }
  },
});

let utcOffset = Number.NaN;
/** The server's monotonic clock restarts with the server; older plots are invalid then. */
const SAME_CLOCK_S = 1;

function receive(message: ServerMessage): void {
  for (const act of hearers) act();
  switch (message.type) {
    case "hello":
      if (Math.abs(message.utc_offset - utcOffset) > SAME_CLOCK_S) telemetry.clear();
      utcOffset = message.utc_offset;
      telemetry.utcOffset = utcOffset;
      takeStaleAfter(message.stale_after_s);
      version.value = message.version;
      demo.value = message.demo;
      void loadCatalog(message.schema_revision).catch(() => undefined);
      break;
    case "servos":
      fleet.changeServos(message.servos);
      break;
    case "telemetry": {
      const arrived = monotonic();
      for (const [key, column] of Object.entries(message.channels)) {
        telemetry.push(message.uid, key, column.t, column.v, arrived);
      }
      break;
    }
    case "parameter":
      takeReading(message.uid, message.reading);
      break;
    case "event":
      addEvent({ ...message, params: message.params as Params });
      break;
    case "job":
      setJob(message.job);
      break;
    case "bus":
      bus.value = message.bus;
      break;
    case "frames":
      for (const act of monitors) act(message);
      break;
    case "lease":
      setLeases(message.leases);
      break;
    case "stop":
      stop.value = message.stop;
      break;
    case "error":
      for (const act of refusals) act(message);
      break;
  }
}

const AGAIN_MS = 1000;

/** Request everything of which the socket reports only changes; retry until complete. */
async function refetch(): Promise<void> {
  const round = connection.peek();
  const results = await Promise.allSettled([
    callApi("GET", "/servos").then(fleet.replaceAll),
    callApi("GET", "/bus").then(response => {
      bus.value = response;
    }),
    callApi("GET", "/leases").then(setLeases),
    callApi("GET", "/stop").then(response => {
      stop.value = response;
    }),
    loadCatalog(),
  ]);
  const missing = results.some(result => result.status === "rejected");
  if (missing && up.peek() && round === connection.peek()) setTimeout(() => void refetch(), AGAIN_MS);
}

export function startLink(): void {
  live.start();
  onSignIn(() => live.hurry());
  addEventListener("online", () => live.hurry());
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden) live.hurry();
  });
}
