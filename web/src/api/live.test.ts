/** The socket: up, lost, silent, back again, and nothing sent late. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { CONNECT_MS, type LinkState, Live, SILENCE_MS, type Socket } from "./live";
import type { ServerMessage } from "./types";

class FakeSocket implements Socket {
  readyState = 0;
  onopen: Socket["onopen"] = null;
  onclose: Socket["onclose"] = null;
  onmessage: Socket["onmessage"] = null;
  sent: { type: string; topics?: string[] }[] = [];
  closed = false;

  send(text: string): void {
    this.sent.push(JSON.parse(text));
  }
  close(): void {
    this.closed = true;
    this.readyState = 3;
  }
  accept(): void {
    this.readyState = 1;
    this.onopen?.({} as Event);
  }
  say(message: unknown): void {
    this.onmessage?.({
      data: typeof message === "string" ? message : JSON.stringify(message),
    } as MessageEvent);
  }
  break(): void {
    this.readyState = 3;
    this.onclose?.({} as CloseEvent);
  }
}

let sockets: FakeSocket[];
let states: LinkState[];
let received: ServerMessage[];
let live: Live;
const last = () => sockets.at(-1) as FakeSocket;
const hello = { type: "hello", seq: 1 };

beforeEach(() => {
  vi.useFakeTimers();
  sockets = [];
  states = [];
  received = [];
  live = new Live({
    open: () => {
      const socket = new FakeSocket();
      sockets.push(socket);
      return socket;
    },
    onMessage: message => received.push(message),
    onState: state => states.push(state),
    greeting: () => [{ type: "subscribe", topics: ["servos"], uids: null, frames: null }],
  });
  live.start();
});

afterEach(() => {
  live.stop();
  vi.restoreAllMocks();
  vi.useRealTimers();
});

describe("Live", () => {
  test("greets when open, is up when the server has spoken", () => {
    last().accept();
    expect(last().sent).toEqual([{ type: "subscribe", topics: ["servos"], uids: null, frames: null }]);
    expect(states).toEqual([]);
    last().say(hello);
    expect(states).toEqual(["up"]);
    expect(received).toEqual([hello]);
  });

  test("is down when the socket closes, then reconnects and sends hello again", () => {
    last().accept();
    last().say(hello);
    last().break();
    expect(states).toEqual(["up", "down"]);
    vi.advanceTimersByTime(300);
    expect(sockets).toHaveLength(2);
    last().accept();
    expect(last().sent).toHaveLength(1);
    last().say(hello);
    expect(states).toEqual(["up", "down", "up"]);
  });

  test("tries again and again, ever less often, at least every two seconds", () => {
    for (let i = 0; i < 6; i++) {
      last().break();
      const before = sockets.length;
      vi.advanceTimersByTime(2000);
      expect(sockets.length).toBeGreaterThan(before);
    }
  });

  test("waits longer for a first message than for the next, then tries again", () => {
    vi.advanceTimersByTime(CONNECT_MS - 500);
    last().accept();
    vi.advanceTimersByTime(CONNECT_MS - 500);
    last().say(hello);
    expect(states).toEqual(["up"]);
    last().break();
    vi.advanceTimersByTime(300);
    expect(sockets).toHaveLength(2);
    vi.advanceTimersByTime(CONNECT_MS + 600);
    expect(sockets).toHaveLength(3);
  });

  test("sends a ping when nothing arrives, and is down within two seconds", () => {
    last().accept();
    last().say(hello);
    vi.advanceTimersByTime(1200);
    expect(last().sent.at(-1)?.topics).toEqual(["bus"]);
    expect(states).toEqual(["up"]);
    vi.advanceTimersByTime(SILENCE_MS - 1200 + 300);
    expect(states).toEqual(["up", "down"]);
  });

  test("stays up while the server responds", () => {
    last().accept();
    for (let i = 0; i < 20; i++) {
      last().say({ type: "bus", seq: i });
      vi.advanceTimersByTime(900);
    }
    expect(states).toEqual(["up"]);
    expect(sockets).toHaveLength(1);
  });

  test("sends now or not at all", () => {
    expect(live.send({ type: "stop", mode: "off", by: "Page 1", reason: "" })).toBe(false);
    last().accept();
    expect(live.send({ type: "stop", mode: "off", by: "Page 1", reason: "" })).toBe(true);
    expect(last().sent.map(message => message.type)).toEqual(["subscribe", "stop"]);
    last().break();
    expect(live.send({ type: "stop", mode: "off", by: "Page 1", reason: "" })).toBe(false);
    vi.advanceTimersByTime(300);
    last().accept();
    expect(last().sent.map(message => message.type)).toEqual(["subscribe"]);
  });

  test("an old socket's late words count for nothing", () => {
    const old = last();
    old.accept();
    old.break();
    old.say(hello);
    expect(received).toEqual([]);
    expect(states).toEqual(["down"]);
  });

  test("rubbish is dropped", () => {
    last().accept();
    last().say("not json");
    last().say({ no: "type" });
    expect(received).toEqual([]);
  });

  test("a delayed page reads queued messages before it reports the server as silent", () => {
    last().accept();
    last().say(hello);
    vi.spyOn(performance, "now").mockReturnValue(performance.now() + SILENCE_MS + 300);
    vi.advanceTimersByTime(200);
    last().say({ type: "bus", seq: 2 });
    vi.advanceTimersByTime(100);
    expect(states).toEqual(["up"]);
  });

  test("a delayed page with no queued message is down at once", () => {
    last().accept();
    last().say(hello);
    vi.spyOn(performance, "now").mockReturnValue(performance.now() + SILENCE_MS + 300);
    vi.advanceTimersByTime(260);
    expect(states).toEqual(["up", "down"]);
  });
});
