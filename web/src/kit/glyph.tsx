/** The state glyphs: one shape a state, so that each can be read without its colour. */
import type { ConditionKind } from "../bench/condition";

interface Props {
  kind: ConditionKind;
  size?: number;
}

const CUT = "var(--cut, var(--panel))";

/** The shape of a state, in its colour. Always beside its word. */
export function Glyph({ kind, size = 16 }: Props) {
  return (
    <svg class={`glyph k-${kind}`} width={size} height={size} viewBox="0 0 16 16" aria-hidden="true">
      {SHAPES[kind]()}
    </svg>
  );
}

const SHAPES: Record<ConditionKind, () => preact.JSX.Element> = {
  ok: () => (
    <>
      <circle cx="8" cy="8" r="7.2" fill="currentColor" />
      <path d="M4.6 8.2l2.4 2.4 4.4-4.8" fill="none" stroke={CUT} stroke-width="1.7" />
    </>
  ),
  notice: () => (
    <>
      <path d="M8 .6L15.4 8 8 15.4.6 8z" fill="currentColor" />
      <path d="M8 4.2v1.7M8 7.2v4.4" stroke={CUT} stroke-width="1.7" />
    </>
  ),
  warning: () => (
    <>
      <path d="M8 1L15.6 14.6H.4z" fill="currentColor" />
      <path d="M8 5.6v4.6M8 11.4v1.8" stroke={CUT} stroke-width="1.7" />
    </>
  ),
  protected: () => (
    <>
      <path d="M8 .8l6.4 2v4.6c0 3.8-2.6 6.4-6.4 7.8-3.8-1.4-6.4-4-6.4-7.8V2.8z" fill="currentColor" />
      <path d="M6.2 5v6M9.8 5v6" stroke={CUT} stroke-width="1.7" />
    </>
  ),
  failure: () => (
    <>
      <path d="M1 1h14v14H1z" fill="currentColor" />
      <path d="M4.8 4.8l6.4 6.4M11.2 4.8l-6.4 6.4" stroke={CUT} stroke-width="1.9" />
    </>
  ),
  busy: () => (
    <>
      <path d="M12.6 5.2A5.6 5.6 0 1 1 8 2.4" fill="none" stroke="currentColor" stroke-width="1.7" />
      <path d="M7.4-.2l3.6 2.7-3.6 2.7z" fill="currentColor" />
    </>
  ),
  identifying: () => (
    <>
      <circle
        cx="8"
        cy="8"
        r="6"
        fill="none"
        stroke="currentColor"
        stroke-width="1.8"
        stroke-dasharray="1.6 2.17"
      />
      <circle cx="8" cy="8" r="1.6" fill="currentColor" />
    </>
  ),
  offline: () => (
    <>
      <circle
        cx="8"
        cy="8"
        r="6"
        fill="none"
        stroke="currentColor"
        stroke-width="1.6"
        stroke-dasharray="3.6 2.68"
      />
      <path d="M4.2 11.8l7.6-7.6" stroke="currentColor" stroke-width="1.6" />
    </>
  ),
};
