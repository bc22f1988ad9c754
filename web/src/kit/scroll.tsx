/** A scroll container: named and focusable. */
import type { ComponentChildren } from "preact";

interface Props {
  label: string;
  children: ComponentChildren;
  testid?: string;
}

export function Scroll({ label, children, testid }: Props) {
  return (
    <section
      class="scroll"
      aria-label={label}
      // biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be scrollable by keys alone
      tabIndex={0}
      {...(testid ? { "data-testid": testid } : {})}
    >
      {children}
    </section>
  );
}
