/** The part of a page that scrolls by itself: named, and in reach of the keyboard. */
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
