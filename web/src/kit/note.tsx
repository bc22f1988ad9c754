/** A note: a glyph, a sentence and at most one action, next to its subject. */
import type { ComponentChildren } from "preact";
import { Glyph } from "./glyph";
import "./note.css";

interface Props {
  kind?: "failure" | "warning" | "notice" | "ok";
  /** Across the whole region, tinted; otherwise inline. */
  band?: boolean;
  action?: ComponentChildren;
  testid?: string;
  /** Renders nothing without content. */
  children: ComponentChildren;
}

const ROLES = { failure: "alert", ok: "status", warning: undefined, notice: undefined } as const;

export function Note({ kind = "failure", band = false, action, testid, children }: Props) {
  if (children === null || children === undefined || children === false || children === "") return null;
  return (
    <div
      class={`note-line says-${kind}${band ? " band" : ""}`}
      role={ROLES[kind]}
      {...(testid ? { "data-testid": testid } : {})}
    >
      <Glyph kind={kind} size={band ? 16 : 14} />
      <p>{children}</p>
      {action}
    </div>
  );
}
