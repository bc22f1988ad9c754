import { afterEach, describe, expect, it, vi } from "vitest";
import { ViewLink } from "./view-link";

class Socket {
  static readonly CONNECTING = 0;
  static readonly OPEN = 1;
  static last: Socket;
  readyState = Socket.CONNECTING;
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  close = vi.fn();

  constructor() {
    Socket.last = this;
  }
}

afterEach(() => vi.unstubAllGlobals());

describe("leaving a 3D frame", () => {
  it("closes a socket that is still connecting once it is open, and an open one at once", () => {
    vi.stubGlobal("WebSocket", Socket);
    const link = new ViewLink("key", () => undefined);
    link.open();
    link.close();
    expect(Socket.last.close).not.toHaveBeenCalled();
    Socket.last.onopen?.();
    expect(Socket.last.close).toHaveBeenCalledOnce();

    link.open();
    Socket.last.readyState = Socket.OPEN;
    link.close();
    expect(Socket.last.close).toHaveBeenCalledOnce();
  });
});
