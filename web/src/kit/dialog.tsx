/** The dialog: below the top bar, so that Stop is never covered; Esc closes it without acting. */
import type { ComponentChildren } from "preact";
import { useEffect, useId, useLayoutEffect, useRef } from "preact/hooks";
import { onKey } from "../bench/keys";
import { text } from "../text";
import { Button } from "./button";

interface Props {
  title: string;
  subtitle?: ComponentChildren;
  children: ComponentChildren;
  /** Buttons. Without any, the dialog can only be closed. */
  foot?: ComponentChildren;
  onClose: () => void;
  testid?: string;
}

const FOCUSABLE =
  "button:not(:disabled), input:not(:disabled), select:not(:disabled), textarea:not(:disabled), a[href], summary, [tabindex='0']";

export function Dialog({ title, subtitle, children, foot, onClose, testid }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const body = useRef<HTMLDivElement>(null);
  const heading = useId();
  const close = useRef(onClose);
  close.current = onClose;

  // Before it is painted, so that an Esc pressed as soon as it is seen closes it.
  useLayoutEffect(() => {
    const before = document.activeElement;
    const first = box.current?.querySelector<HTMLElement>("[data-first-focus] :is(button, input, select)");
    (first ?? box.current)?.focus();
    const forget = onKey("Escape", () => close.current());
    return () => {
      forget();
      // The opener may be gone or disabled: the focus then goes to the page.
      if (before instanceof HTMLElement && before.isConnected) before.focus();
      if (document.activeElement === document.body) document.querySelector("main")?.focus();
    };
  }, []);

  // Scrollable by keys even without focusable content. Words may arrive after the frame.
  const reach = () => {
    const inner = body.current;
    if (!inner) return;
    if (inner.scrollHeight > inner.clientHeight) inner.tabIndex = 0;
    else inner.removeAttribute("tabindex");
  };
  useEffect(reach);

  // Traps Tab; Stop stays available by Esc, Space and pointer.
  const cycle = (event: KeyboardEvent) => {
    if (event.key !== "Tab" || !box.current) return;
    reach();
    const all = [...box.current.querySelectorAll<HTMLElement>(FOCUSABLE)].filter(
      one => one.getClientRects().length > 0,
    );
    const edge = event.shiftKey ? all[0] : all.at(-1);
    if (document.activeElement === edge || !box.current.contains(document.activeElement)) {
      event.preventDefault();
      (event.shiftKey ? all.at(-1) : all[0])?.focus();
    }
  };

  return (
    <div class="scrim">
      <div
        ref={box}
        class="dialog"
        role="dialog"
        aria-modal="true"
        aria-labelledby={heading}
        tabIndex={-1}
        onKeyDown={cycle}
        {...(testid ? { "data-testid": testid } : {})}
      >
        <div class="dialog-head">
          <h2 id={heading}>{title}</h2>
          {subtitle && <p class="second">{subtitle}</p>}
        </div>
        <div ref={body} class="dialog-body">
          {children}
        </div>
        <div class="dialog-foot">{foot ?? <Quit onClose={onClose} />}</div>
      </div>
    </div>
  );
}

interface QuitProps {
  onClose: () => void;
  word?: string;
  testid?: string;
}

/** The button that closes a dialog without acting; has the initial focus. */
export function Quit({ onClose, word = text.close, testid = "quit" }: QuitProps) {
  return (
    <span data-first-focus>
      <Button testid={testid} onClick={onClose}>
        {word}
      </Button>
    </span>
  );
}
