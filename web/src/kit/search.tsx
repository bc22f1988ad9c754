/** The search box; "/" focuses it, Esc clears and leaves it. */
import { useLayoutEffect, useRef } from "preact/hooks";
import { onKey } from "../bench/keys";
import type { Cell } from "./field";
import { Icon } from "./icon";

interface Props {
  label: string;
  at: Cell<string>;
}

export function Search({ label, at }: Props) {
  const box = useRef<HTMLInputElement>(null);
  // Before paint: once the box is visible, its key works.
  useLayoutEffect(() => onKey("/", () => box.current?.focus()), []);
  return (
    <label class="search">
      <Icon name="search" size={16} />
      <span class="hidden-text">{label}</span>
      <input
        ref={box}
        type="search"
        placeholder={label}
        value={at.value}
        autocomplete="off"
        onInput={event => {
          at.value = event.currentTarget.value;
        }}
        onKeyDown={event => {
          if (event.key !== "Escape") return;
          event.preventDefault();
          at.value = "";
          document.querySelector("main")?.focus();
        }}
      />
      <kbd class="touch-hide">/</kbd>
    </label>
  );
}
