/** What every step of the wizard has: its question at the top, and its actions at the foot. */
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";

/** The one question of a step. It takes the focus, so that a reader hears what is asked now. */
export function StepQuestion({ title, children }: { title: string; children?: ComponentChildren }) {
  const heading = useRef<HTMLHeadingElement>(null);
  useEffect(() => {
    // On the way from step to step; whoever is typing stays there.
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

/** The bar of actions: what goes back at the left, the one that goes on at the right, far from Stop. */
export function Actions({ children }: { children: ComponentChildren }) {
  return <div class="wizard-actions">{children}</div>;
}
