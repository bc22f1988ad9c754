/** A card of the Overview: title, link and content. */
import type { ComponentChildren } from "preact";
import { follow } from "../kit/follow";

interface Props {
  title: string;
  /** Link to the full list, and its name. */
  path: string;
  link: string;
  wide?: boolean;
  testid: string;
  children: ComponentChildren;
}

export function Card({ title, path, link, wide = false, testid, children }: Props) {
  return (
    <section class={`o-card ${wide ? "wide" : ""}`} aria-label={title} data-testid={testid}>
      <header>
        <h2>{title}</h2>
        <a class="link small" href={path} onClick={event => follow(event, path)}>
          {link}
        </a>
      </header>
      {children}
    </section>
  );
}

interface FactProps {
  glyph: ComponentChildren;
  line?: ComponentChildren;
  children: ComponentChildren;
}

/** A glyph, a sentence, and details in small type. */
export function Fact({ glyph, line, children }: FactProps) {
  return (
    <div class="o-fact">
      <span class="o-glyph">{glyph}</span>
      <p>
        {children}
        {line && <small class="second">{line}</small>}
      </p>
    </div>
  );
}
