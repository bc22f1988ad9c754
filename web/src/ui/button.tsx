/** Owns the button: one look, and the rule that what acts on the server waits for the link. */
import type { ComponentChildren, JSX } from "preact";
import { up } from "../state/link";

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
  /** What it does, for screen readers, where the words on it are not enough; it begins with them. */
  label?: string;
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
  refTo,
}: Props) {
  return (
    <button
      type="button"
      ref={refTo ?? null}
      class={`button ${look ?? ""}`}
      disabled={disabled === true || (live === true && !up.value)}
      onClick={onClick}
      {...(testid ? { "data-testid": testid } : {})}
      {...(title ? { title } : {})}
      {...(label ? { "aria-label": label } : {})}
      {...(pressed === undefined ? {} : { "aria-pressed": pressed })}
    >
      {children}
    </button>
  );
}
