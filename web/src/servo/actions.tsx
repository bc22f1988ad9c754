/** Actions on the servo of a page: wiggle, restart, factory reset. Refused here, or confirmed in a dialog. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { type KnownServo, nameOf } from "../bench/fleet";
import { angle } from "../bench/format";
import { commanderOf, observing } from "../bench/role";
import { wiggle, wiggled, wiggling } from "../bench/wiggle";
import { beginChange, underWay } from "../change/flow";
import { resetChange, restartChange } from "../change/requests";
import { actionWords } from "../change/words";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { Menu } from "../kit/menu";
import { useKeys } from "../kit/use-keys";
import { text } from "../text";
import "./actions.css";

type Verb = "restart" | "factory-reset";

const strings = actionWords;

/** How long the success of a wiggle is shown. */
const SAID_MS = 6000;

export function ServoActions({ one }: { one: KnownServo }) {
  const { uid } = one;
  const by = commanderOf(one);
  const checking = useSignal<Verb | null>(null);
  const refused = useSignal<string | null>(null);
  /** Only wiggles started from here are reported. */
  const reporting = useSignal(false);
  const shake = () => {
    refused.value = null;
    if (wiggling.peek() || observing.peek()) return;
    reporting.value = true;
    void wiggle(uid);
  };
  useKeys({ w: shake });
  const check = async (verb: Verb) => {
    if (checking.peek() !== null) return;
    refused.value = null;
    reporting.value = false;
    checking.value = verb;
    const why = await beginChange(verb === "restart" ? restartChange([uid]) : resetChange(uid, nameOf(one)));
    if (why !== null) refused.value = verb === "restart" ? strings.notRestarted(why) : strings.notReset(why);
    checking.value = null;
  };
  const why = underWay([uid]) ? strings.underWay(1) : null;
  const last = reporting.value && wiggled.value?.uid === uid ? wiggled.value : null;
  const moved = last?.phase === "moved";
  useEffect(() => {
    if (!moved) return undefined;
    const timer = setTimeout(() => {
      reporting.value = false;
    }, SAID_MS);
    return () => clearTimeout(timer);
  }, [moved]);
  const bad = refused.value ?? (last?.phase === "refused" ? strings.notWiggled(last.why) : null);
  if (observing.value) return null;
  return (
    <div class="servo-actions">
      <Button
        live
        testid="wiggle"
        disabled={by !== undefined}
        title={by ? text.motion.whileCommanded(nameOf(one), by.node_id) : strings.wiggleHint}
        onClick={shake}
      >
        <Icon name="wiggle" /> {strings.wiggle} <kbd class="touch-hide">W</kbd>
      </Button>
      <Menu label={strings.label(nameOf(one))} word={strings.more} testid="servo-menu">
        {[
          {
            key: "restart",
            label: strings.restart,
            line: strings.restartLine,
            why,
            act: () => void check("restart"),
          },
          {
            key: "factory-reset",
            label: strings.reset,
            line: strings.resetLine,
            why,
            destructive: true,
            act: () => void check("factory-reset"),
          },
        ]}
      </Menu>
      {(bad !== null || checking.value !== null || last !== null) && (
        <div class="servo-says" data-testid="servo-says" data-phase={bad !== null ? "refused" : last?.phase}>
          {bad !== null ? (
            <p role="alert">
              <Glyph kind="failure" /> <span>{bad}</span>
              <Button
                look="plain"
                onClick={() => {
                  refused.value = null;
                  reporting.value = false;
                }}
              >
                {strings.dismiss}
              </Button>
            </p>
          ) : (
            <p role="status">
              {moved ? <Glyph kind="ok" /> : <Spinner />}
              <span>{checking.value !== null ? strings.checking : last !== null ? progress(last) : ""}</span>
            </p>
          )}
        </div>
      )}
    </div>
  );
}

function progress(last: NonNullable<typeof wiggled.value>): string {
  switch (last.phase) {
    case "requesting":
      return strings.requesting;
    case "moving":
      return strings.moving(angle(last.around));
    case "moved":
      return strings.moved(angle(last.low), angle(last.high));
    case "refused":
      return strings.notWiggled(last.why);
  }
}
