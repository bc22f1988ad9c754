/** Unknown address: what is unknown, and a link back. */
import type { ComponentChildren } from "preact";
import { loaded } from "../bench/fleet";
import { go, pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { LoadingPage } from "../kit/loaded";
import { text } from "../text";

/** No page has this address. */
export function MissingPage() {
  return (
    <Missing title={text.missing.page} testid="missing-page">
      <p class="second">
        <span class="mono">{location.pathname}</span>
      </p>
      <p>{text.missing.pageLine}</p>
    </Missing>
  );
}

/** The address names an unknown servo. */
export function MissingServo({ uid }: { uid: string }) {
  if (!loaded.value) return <LoadingPage />;
  return (
    <Missing title={text.missing.servo} testid="missing-servo">
      <p class="second">
        {text.missing.uid} <span class="mono">{uid}</span>
      </p>
      <p>{text.missing.servoLine}</p>
    </Missing>
  );
}

function Missing(props: { title: string; testid: string; children: ComponentChildren }) {
  return (
    <div class="page">
      <section class="empty" data-testid={props.testid}>
        <div>
          <h1>{props.title}</h1>
          {props.children}
          <p class="below-line">
            <Button look="primary" onClick={() => go(pathOf("servos", null))}>
              {text.params.toServos}
            </Button>
          </p>
        </div>
      </section>
    </div>
  );
}
