/** A button that opens a menu of actions, by pointer, touch and keys, each with a line of help. */
import { useId, useLayoutEffect } from "preact/hooks";
import { Button } from "./button";
import { Icon } from "./icon";
import { usePopup } from "./popup";
import "./menu.css";

export interface Item {
  key: string;
  label: string;
  /** Short description. */
  line: string;
  /** Irreversible: set apart, in the failure colour. */
  destructive?: boolean;
  /** Why it is disabled. */
  why?: string | null;
  act: () => void;
}

interface Props {
  /** Accessible name; `word` is visible. */
  label: string;
  word: string;
  testid: string;
  children: readonly Item[];
}

export function Menu({ label, word, testid, children }: Props) {
  const { open, box, close } = usePopup<HTMLDivElement>();
  const id = useId();
  useLayoutEffect(() => {
    if (open.value) box.current?.querySelector<HTMLElement>("[role=menuitem]")?.focus();
  }, [open.value]);
  const move = (event: KeyboardEvent) => {
    const all = [...(box.current?.querySelectorAll<HTMLElement>("[role=menuitem]") ?? [])];
    const at = all.indexOf(document.activeElement as HTMLElement);
    const to: Readonly<Record<string, number>> = {
      ArrowDown: (at + 1) % all.length,
      ArrowUp: (at - 1 + all.length) % all.length,
      Home: 0,
      End: all.length - 1,
    };
    const next = to[event.key];
    if (next === undefined) return;
    event.preventDefault();
    all[next]?.focus();
  };
  return (
    <div ref={box} class="menu">
      <Button
        testid={testid}
        label={label}
        popup={{ open: open.value, id }}
        onClick={() => {
          open.value = !open.peek();
        }}
      >
        {word} <Icon name="down" size={16} />
      </Button>
      {open.value && (
        <div id={id} class="menu-items" role="menu" tabIndex={-1} aria-label={label} onKeyDown={move}>
          {children.map(one => (
            <button
              key={one.key}
              type="button"
              role="menuitem"
              tabIndex={-1}
              class={one.destructive ? "destructive" : ""}
              data-testid={`menu-${one.key}`}
              aria-disabled={one.why != null}
              onClick={() => {
                if (one.why != null) return;
                close();
                one.act();
              }}
            >
              <span>{one.label}</span>
              <small>{one.why ?? one.line}</small>
            </button>
          ))}
        </div>
      )}
    </div>
  );
}
