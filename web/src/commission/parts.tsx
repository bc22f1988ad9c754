/** Parts of every step of the wizard: heading, and actions at the foot. */
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";

/** The heading of a step. It takes the focus, so that screen readers announce it. */
export function StepQuestion({ title, children }: { title: string; children?: ComponentChildren }) {
  const heading = useRef<HTMLHeadingElement>(null);
  useEffect(() => {
    // Only on a change of step, and not while the user is typing.
    const held = document.activeElement;
    if (held === null || held === document.body || !held.isConnected) heading.current?.focus();
  }, []);
  return (
    <div class="question">
      <h1 ref={heading} tabIndex={-1}>
        {title}
      </h1>
      {children}
    </div>
  );
}

/** The bar of actions: back at the left, forward at the right, far from Stop. */
export function Actions({ children }: { children: ComponentChildren }) {
  return <div class="wizard-actions">{children}</div>;
}
