/** The button: one look; actions on the server are disabled without a link; a held key is one press. */
import type { ComponentChildren, JSX } from "preact";
import { up } from "../bench/link";

interface Props {
  children: ComponentChildren;
  onClick: () => void;
  look?: "primary" | "danger" | "plain" | "two" | "two primary";
  /** Acts on the server: disabled while there is no link. */
  live?: boolean;
  disabled?: boolean;
  testid?: string;
  title?: string;
  autofocus?: boolean;
  pressed?: boolean;
  /** Accessible name, where the visible words are not enough. It starts with them. */
  label?: string;
  /** ID of the menu that it opens. */
  popup?: { open: boolean; id: string };
  refTo?: JSX.IntrinsicElements["button"]["ref"];
}

export function Button({
  children,
  onClick,
  look,
  live,
  disabled,
  testid,
  title,
  pressed,
  label,
  popup,
  refTo,
}: Props) {
  return (
    <button
      type="button"
      ref={refTo ?? null}
      class={`button ${look ?? ""}`}
      disabled={disabled === true || (live === true && !up.value)}
      onClick={onClick}
      onKeyDown={onePress}
      {...(testid ? { "data-testid": testid } : {})}
      {...(title ? { title } : {})}
      {...(label ? { "aria-label": label } : {})}
      {...(popup
        ? {
            "aria-haspopup": "menu",
            "aria-expanded": popup.open,
            ...(popup.open ? { "aria-controls": popup.id } : {}),
          }
        : {})}
      {...(pressed === undefined ? {} : { "aria-pressed": pressed })}
    >
      {children}
    </button>
  );
}

/** A browser clicks again for each repeat of a held Enter. */
function onePress(event: KeyboardEvent): void {
  if (event.repeat && event.key === "Enter") event.preventDefault();
}
