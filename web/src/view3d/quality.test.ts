import { afterEach, describe, expect, it, vi } from "vitest";
import { ViewLink } from "../bench/view-link";
import { DrawRate } from "./quality";

function judge(hz: number, seconds: number): boolean {
  const rate = new DrawRate(0);
  for (let at = 0; at < seconds * 1000; at += 1000 / hz) if (rate.draw(at)) return true;
  return false;
}

describe("the draw rate", () => {
  it("is too low after two poor windows, never while the frame opens", () => {
    expect(judge(5, 9)).toBe(false);
    expect(judge(5, 12)).toBe(true);
    expect(judge(30, 60)).toBe(false);
  });

  it("is not judged by one poor moment", () => {
    const rate = new DrawRate(0);
    let poor = false;
    for (let at = 4000; at < 40_000; at += at % 9000 < 2500 ? 400 : 20) poor ||= rate.draw(at);
    expect(poor).toBe(false);
  });
});

class FakeSocket {
  static all: FakeSocket[] = [];
  static readonly CONNECTING = 0;
  static readonly OPEN = 1;
  readyState = 0;
  sent: string[] = [];
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: ((event: { data: string }) => void) | null = null;
  url: string;
  constructor(url: string) {
    this.url = url;
    FakeSocket.all.push(this);
  }
  open() {
    this.readyState = 1;
    this.onopen?.();
  }
  send(text: string) {
    this.sent.push(text);
  }
  close() {
    this.readyState = 3;
    this.onclose?.();
  }
}

describe("the socket beside a frame", () => {
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
    FakeSocket.all = [];
  });
  const settings = { select: "a".repeat(32), theme: "dark", quality: "low", visible: true } as const;

  it("sends the newest settings once open, each once, and receives clicks", () => {
    vi.stubGlobal("WebSocket", FakeSocket);
    const picked: string[] = [];
    const link = new ViewLink("k".repeat(32), uid => picked.push(uid));
    link.send(settings);
    link.open();
    const socket = FakeSocket.all[0];
    expect(socket?.url).toMatch(/\/viser\/k{32}\/settings$/);
    link.send({ ...settings, quality: "high" });
    socket?.open();
    link.send({ ...settings, quality: "high" });
    expect(socket?.sent.map(one => JSON.parse(one).quality)).toEqual(["high"]);
    socket?.onmessage?.({ data: JSON.stringify({ picked: "b" }) });
    expect(picked).toEqual(["b"]);
    link.close();
  });

  it("is closed after it opened if left while connecting: else the console shows an error", () => {
    vi.stubGlobal("WebSocket", FakeSocket);
    const link = new ViewLink("k".repeat(32), () => undefined);
    link.open();
    link.close();
    const socket = FakeSocket.all[0];
    expect(socket?.readyState).toBe(0);
    socket?.open();
    expect(socket?.readyState).toBe(3);
    expect(socket?.sent).toEqual([]);
  });

  it("reconnects and sends the settings again, until it is closed", () => {
    vi.useFakeTimers();
    vi.stubGlobal("WebSocket", FakeSocket);
    const link = new ViewLink("k".repeat(32), () => undefined);
    link.send(settings);
    link.open();
    FakeSocket.all[0]?.open();
    FakeSocket.all[0]?.close();
    vi.advanceTimersByTime(5000);
    expect(FakeSocket.all).toHaveLength(2);
    FakeSocket.all[1]?.open();
    expect(FakeSocket.all[1]?.sent).toHaveLength(1);
    link.close();
    vi.advanceTimersByTime(60_000);
    expect(FakeSocket.all).toHaveLength(2);
  });
});
