/** Notes on a servo, and their editor. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { callApi, problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import { connection, up } from "../bench/link";
import { pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { Note } from "../kit/note";
import { Card } from "./card";
import { written } from "./state";
import { overview as words } from "./words";

const LONGEST = 4000;

export function Notes({ uid }: { uid: string }) {
  const stored = useSignal<string | null>(null);
  const typed = useSignal<string | null>(null);
  const problem = useSignal<string | null>(null);
  const round = connection.value;
  const act = async (deed: () => Promise<{ notes: string }>) => {
    problem.value = null;
    try {
      stored.value = (await deed()).notes;
      return true;
    } catch (error) {
      problem.value = problemText(problemOf(error));
      return false;
    }
  };
  useEffect(() => {
    if (round > 0) void act(() => callApi("GET", "/inventory/{uid}", { path: { uid } }));
  }, [uid, round]);
  const keep = async () => {
    const notes = typed.peek() ?? "";
    if (await act(() => callApi("PATCH", "/inventory/{uid}", { path: { uid }, body: { notes } }))) {
      typed.value = null;
      written.value += 1;
    }
  };
  return (
    <Card
      title={words.notes}
      path={pathOf("records", null, "inventory")}
      link={words.toInventory}
      testid="card-notes"
    >
      {typed.value === null ? (
        <>
          <p class={stored.value ? "o-notes" : "second"}>{stored.value || words.noNotes}</p>
          <Button
            live
            testid="notes-edit"
            disabled={stored.value === null}
            onClick={() => {
              typed.value = stored.peek() ?? "";
            }}
          >
            {words.write}
          </Button>
        </>
      ) : (
        <form
          onSubmit={event => {
            event.preventDefault();
            void keep();
          }}
        >
          <textarea
            class="field"
            rows={4}
            maxLength={LONGEST}
            aria-label={words.notes}
            data-testid="notes-box"
            ref={box => box?.focus()}
            value={typed.value}
            onInput={event => {
              typed.value = event.currentTarget.value;
            }}
          />
          <div class="o-buttons">
            <Button onClick={() => (typed.value = null)}>{words.discard}</Button>
            <button type="submit" class="button primary" data-testid="notes-keep" disabled={!up.value}>
              {words.saveNotes}
            </button>
          </div>
        </form>
      )}
      <Note>{problem.value}</Note>
    </Card>
  );
}
