/** The search box; "/" puts the focus in it, Esc clears and leaves it. */
import { useLayoutEffect, useRef } from "preact/hooks";
import { onKey } from "../bench/keys";
import { Icon } from "./icon";

interface Props {
  label: string;
  value: string;
  onInput: (value: string) => void;
}

export function Search({ label, value, onInput }: Props) {
  const box = useRef<HTMLInputElement>(null);
  // Before it is painted: who sees the box can use its key.
  useLayoutEffect(() => onKey("/", () => box.current?.focus()), []);
  return (
    <label class="search">
      <Icon name="search" size={16} />
      <span class="hidden-text">{label}</span>
      <input
        ref={box}
        type="search"
        placeholder={label}
        value={value}
        autocomplete="off"
        onInput={event => onInput(event.currentTarget.value)}
        onKeyDown={event => {
          if (event.key !== "Escape") return;
          event.preventDefault();
          onInput("");
          document.querySelector("main")?.focus();
        }}
      />
      <kbd class="touch-hide">/</kbd>
    </label>
  );
}
