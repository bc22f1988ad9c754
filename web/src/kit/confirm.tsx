/** A confirmation: says what happens, does it once, and stays open with the reason on failure. */

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
  /** Verb on the button, the same as in the title. */
  verb: string;
  /** Label while it runs. */
  doing?: string;
  /** Irreversible, or may move something: the button is marked, and Enter in a field does nothing. */
  danger?: boolean;
  /** False until required input is there. */
  ready?: boolean;
  /** Acts on this page only: needs no link. */
  local?: boolean;
  cancel?: string;
  testid?: string;
  /** Test ID of the button that acts. */
  actId?: string;
  /** An exception is shown; the returned value is that of the dialog. */
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
        {/* Enter in a field acts like the button, unless dangerous. */}
        <button type="submit" hidden disabled={danger || !able} />
      </form>
    </Dialog>
  );
}
