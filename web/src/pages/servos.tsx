/** Owns the Servos page: every servo a row, who is waiting for a node id, and what to do when there is none. */
import { useComputed, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { watchAllocations } from "../state/allocations";
import { needsAttention } from "../state/condition";
import { connected } from "../state/desk";
import { all, type KnownServo, loaded, nameOf } from "../state/fleet";
import { conditionHere } from "../state/here";
import { up } from "../state/link";
import { text } from "../text/en";
import { Button } from "../ui/button";
import { Search } from "../ui/search";
import { Segments } from "../ui/segments";
import { EmptyServos, Reconnect } from "./empty-servos";
import { ServoRow } from "./servo-row";
import { Waiting } from "./waiting";

type Filter = "all" | "attention" | "unsaved";

export function ServosPage() {
  useEffect(() => watchAllocations().end, []);
  const filter = useSignal<Filter>("all");
  const wanted = useSignal("");
  const counts = useComputed(() => ({
    known: all.value.length,
    online: all.value.filter(one => one.online).length,
    attention: all.value.filter(one => needsAttention(conditionHere(one).kind)).length,
    unsaved: all.value.filter(one => one.unsaved.length > 0).length,
  })).value;
  // Only the list of uids goes down: a row redraws itself.
  const shown = useComputed(() =>
    all.value
      .filter(one => matches(one, wanted.value) && passes(one, filter.value))
      .map(one => one.uid)
      .join(" "),
  ).value;
  const uids = shown === "" ? [] : shown.split(" ");
  const showAll = () => {
    filter.value = "all";
    wanted.value = "";
  };
  return (
    <div class="page">
      <div class="page-head">
        <h1>{text.servos.title}</h1>
        {counts.known > 0 && (
          <span class="dim">{text.servos.known(counts.known, up.value ? counts.online : null)}</span>
        )}
        {counts.known > 0 && (
          <>
            <Search
              label={text.servos.search}
              value={wanted.value}
              onInput={value => {
                wanted.value = value;
              }}
            />
            <Segments<Filter>
              label={text.servos.filter}
              chosen={filter.value}
              onChoose={key => {
                filter.value = key;
              }}
              options={[
                { key: "all", label: text.servos.all(counts.known) },
                { key: "attention", label: text.servos.attention(counts.attention) },
                { key: "unsaved", label: text.servos.unsaved(counts.unsaved) },
              ]}
            />
          </>
        )}
      </div>
      <div class="scroll">
        {counts.known > 0 && !connected.value && <Reconnect />}
        {counts.known > 0 && (
          <div role="table" aria-label={text.servos.title} class="servos">
            <Head />
            {uids.map(uid => (
              <ServoRow key={uid} uid={uid} />
            ))}
          </div>
        )}
        {counts.known > 0 && uids.length === 0 && (
          <p class="notice-line">
            {text.servos.nothingFound} <Button onClick={showAll}>{text.servos.showAll}</Button>
          </p>
        )}
        <Waiting />
        {counts.known === 0 && <EmptyServos loading={!loaded.value} />}
        {counts.known > 0 && <p class="small dim below">{text.servos.more}</p>}
      </div>
    </div>
  );
}

function Head() {
  const head = text.servos.head;
  return (
    <div role="row" class="servo-grid servo-head">
      <span role="columnheader" class="c-angle right">
        {head.angle}
      </span>
      <span role="columnheader" class="c-name">
        {head.servo}
      </span>
      <span role="columnheader" class="c-ids">
        {head.ids}
      </span>
      <span role="columnheader" class="c-health">
        {head.health}
      </span>
      <span role="columnheader" class="c-spark">
        {head.recent}
      </span>
      <span role="columnheader" class="c-supply">
        {head.supply}
      </span>
      <span role="columnheader" class="c-age">
        {head.age}
      </span>
      <span role="columnheader" class="c-rom">
        {head.rom}
      </span>
    </div>
  );
}

function matches(one: KnownServo, wanted: string): boolean {
  const words = wanted.trim().toLowerCase();
  if (words === "") return true;
  const facts = [nameOf(one), one.serial, one.uid, one.model, one.servo_id, one.node_id];
  return facts.some(fact => fact !== null && String(fact).toLowerCase().includes(words));
}

function passes(one: KnownServo, filter: Filter): boolean {
  if (filter === "attention") return needsAttention(conditionHere(one).kind);
  return filter === "all" || one.unsaved.length > 0;
}
