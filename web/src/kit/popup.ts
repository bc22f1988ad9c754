/** Popups opened by a button: closed by Esc, a press outside and loss of focus. */
import { type Signal, useSignal } from "@preact/signals";
import type { RefObject } from "preact";
import { useLayoutEffect, useRef } from "preact/hooks";
import { onKey } from "../bench/keys";

interface Popup<Box> {
  open: Signal<boolean>;
  /** Contains the button first, then the popup. */
  box: RefObject<Box | null>;
  /** Close it and focus the button again. */
  close: () => void;
}

export function usePopup<Box extends HTMLElement>(): Popup<Box> {
  const open = useSignal(false);
  const box = useRef<Box>(null);
  const close = () => {
    open.value = false;
    box.current?.querySelector("button")?.focus();
  };
  useLayoutEffect(() => {
    if (!open.value) return undefined;
    const away = (event: Event) => {
      if (!box.current?.contains(event.target as Node)) open.value = false;
    };
    const forget = onKey("Escape", close);
    document.addEventListener("pointerdown", away, true);
    document.addEventListener("focusin", away);
    return () => {
      forget();
      document.removeEventListener("pointerdown", away, true);
      document.removeEventListener("focusin", away);
    };
  }, [open.value]);
  return { open, box, close };
}
