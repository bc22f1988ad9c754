/** A question before an act: says what happens, does it once, stays open with the reason when it is refused. */

import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import { up } from "../bench/link";
import { text } from "../text";
import { Button } from "./button";
import { Dialog, Quit } from "./dialog";
import { Spinner } from "./icon";
import { Note } from "./note";

interface Props<T> {
  title: string;
  subtitle?: ComponentChildren;
  children?: ComponentChildren;
  /** The verb of the title, on the button. */
  verb: string;
  /** The verb while it is being done. */
  doing?: string;
  /** Cannot be undone, or may move something: the button says so, and Enter in a field does nothing. */
  danger?: boolean;
  /** False while something has to be filled in first. */
  ready?: boolean;
  /** Acts on this page alone: needs no link. */
  local?: boolean;
  cancel?: string;
  testid?: string;
  /** Of the button that acts. */
  actId?: string;
  /** What it throws is shown; what it gives is what the dialog closes with. */
  act: () => T | Promise<T>;
  /** Null: closed without acting. */
  onClose: (done: T | null) => void;
}

export function Confirm<T>(props: Props<T>) {
  const { title, subtitle, children, verb, doing, danger = false, ready = true, local = false } = props;
  const busy = useSignal(false);
  const problem = useSignal<string | null>(null);
  const act = async () => {
    if (busy.peek()) return;
    busy.value = true;
    problem.value = null;
    try {
      props.onClose(await props.act());
    } catch (error) {
      problem.value = problemText(problemOf(error));
    }
    busy.value = false;
  };
  const able = ready && !busy.value && (local || up.value);
  const close = () => props.onClose(null);
  return (
    <Dialog
      title={title}
      subtitle={subtitle}
      onClose={close}
      {...(props.testid ? { testid: props.testid } : {})}
      foot={
        <>
          <Quit onClose={close} word={props.cancel ?? text.cancel} />
          <Button
            look={danger ? "danger" : "primary"}
            live={!local}
            disabled={!ready || busy.value}
            onClick={() => void act()}
            {...(props.actId ? { testid: props.actId } : {})}
          >
            {doing && busy.value && <Spinner />}
            {(busy.value && doing) || verb}
          </Button>
        </>
      }
    >
      <form
        class="confirm-body"
        onSubmit={event => {
          event.preventDefault();
          void act();
        }}
      >
        {children}
        <Note>{problem.value}</Note>
        {/* Enter in a field does what the button does, but for what is dangerous. */}
        <button type="submit" hidden disabled={danger || !able} />
      </form>
    </Dialog>
  );
}
