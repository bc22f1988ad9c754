/** A card of the Overview: title, link and content. */
import type { ComponentChildren } from "preact";
import type { Resource } from "../bench/resource";
import { follow } from "../kit/follow";
import { Glyph } from "../kit/glyph";

/** A value that is requested from the server. */
type Loading = Pick<Resource<unknown>, "value" | "problem">;

interface Props {
  title: string;
  /** Link to the full list, and its name. */
  path: string;
  link: string;
  wide?: boolean;
  testid: string;
  /** What the content is made of. Until it is loaded, the content only takes its place. */
  of?: Loading;
  children: ComponentChildren;
}

export function Card({ title, path, link, wide = false, testid, of, children }: Props) {
  const known = of === undefined || of.value.value !== null;
  const failed = of !== undefined && of.problem.value !== null;
  return (
    <section class={`o-card ${wide ? "wide" : ""}`} aria-label={title} data-testid={testid}>
      <header>
        <h2>{title}</h2>
        <a class="link small" href={path} onClick={event => follow(event, path)}>
          {link}
        </a>
      </header>
      {of && <Trouble of={of} />}
      {(known || !failed) && <div class={known ? "" : "unseen"}>{children}</div>}
    </section>
  );
}

/** Why a request failed. */
export function Trouble({ of }: { of: Loading }) {
  if (of.problem.value === null) return null;
  return (
    <p class="small" role="alert">
      <Glyph kind="failure" size={14} /> {of.problem.value}
    </p>
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
