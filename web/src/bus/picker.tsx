/** The adapter picker: detected adapters as cards, any other address, and opening one. */

import { computed, type Signal, signal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import type { Adapter } from "../api/bus-types";
import { callApi, problemOf } from "../api/client";
import { bus } from "../bench/bench";
import { channelOf } from "../bench/bus-now";
import { monotonic, now } from "../bench/clock";
import type { ConditionKind } from "../bench/condition";
import { causeText, problemText } from "../bench/facts";
import { age, grouped, number } from "../bench/format";
import { parseNumber } from "../bench/number";
import { poll } from "../bench/poll";
import { Button } from "../kit/button";
import { cell, TextField } from "../kit/field";
import { Glyph } from "../kit/glyph";
import { Guides } from "../kit/guide";
import { Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import { type RoleChoice, Roles } from "../role/dialog";
import { roleWords } from "../role/words";
import { text } from "../text";
import { LineFacts } from "./line";
import { Remedy } from "./remedy";
import { busWords as words } from "./words";

const strings = words.connectDialog;

/** The entry for a typed address. */
const OTHER = "";
const DEMO = "memory:";
const SERIAL = "slcan:";
const USUAL_BITRATE = 1_000_000;
const POLL_MS = 2000;
/** Longer than the server's own deadline for opening. */
const OPENING_MS = 30_000;

export interface Picker {
  adapters: Signal<readonly Adapter[] | null>;
  searchedAt: Signal<number>;
  listProblem: Signal<string | null>;
  /** The address of a card, or OTHER. */
  chosen: Signal<string | null>;
  typed: Signal<string>;
  kbit: Signal<string>;
  /** Pause between the frames of one transfer as typed, ms. */
  gap: Signal<string>;
  role: Signal<RoleChoice>;
  opening: Signal<boolean>;
  refused: Signal<{ text: string; command: unknown } | null>;
  /** What Connect opens; null while nothing valid is selected. */
  target: { readonly value: Target | null };
  open: () => Promise<boolean>;
}

interface Target {
  address: string;
  bitrate: number;
  frame_gap_ms?: number;
  role: RoleChoice;
}

/** Polls the list of adapters while it is shown, so that new ones appear automatically. */
export function usePicker(): Picker {
  const picker = useMemo(makePicker, []);
  useEffect(() => {
    const search = async () => {
      try {
        picker.adapters.value = adaptersInOrder(await callApi("GET", "/bus/adapters"));
        picker.listProblem.value = null;
        picker.chosen.value = chosenOf(picker.adapters.value, picker.chosen.peek());
      } catch (error) {
        picker.listProblem.value = problemText(problemOf(error));
      }
      picker.searchedAt.value = monotonic();
    };
    return poll(POLL_MS, search).end;
  }, []);
  return picker;
}

/** Simulated servos inside the server, always available. */
export function isDemo(one: Adapter): boolean {
  return one.address.startsWith(DEMO);
}

/** Detected adapters first, the demo last. */
export function adaptersInOrder(list: readonly Adapter[]): Adapter[] {
  return [...list.filter(one => !isDemo(one)), ...list.filter(isDemo)];
}

/** The card to select: the present one while it is usable, else the first that is not connected. */
export function chosenOf(list: readonly Adapter[], present: string | null): string | null {
  const usable = list.filter(one => one.usable);
  if (present === OTHER || usable.some(one => one.address === present)) return present;
  return (usable.find(one => one.state !== "connected") ?? usable[0])?.address ?? null;
}

function makePicker(): Picker {
  const chosen = signal<string | null>(null);
  const typed = signal("");
  const kbit = signal(String(USUAL_BITRATE / 1000));
  const opening = signal(false);
  const refused: Picker["refused"] = signal(null);
  const gap = signal(String(bus.peek()?.frame_gap_ms ?? 0));
  const role = signal<RoleChoice>("auto");
  const target = computed<Target | null>(() => {
    const pause = gapOf(gap.value);
    if (chosen.value === null || pause === null) return null;
    const option = { role: role.value, ...(pause > 0 ? { frame_gap_ms: pause } : {}) };
    if (chosen.value !== OTHER) return { address: chosen.value, bitrate: USUAL_BITRATE, ...option };
    const address = typed.value.trim();
    const bitrate = bitrateOf(kbit.value);
    return address === "" || bitrate === null ? null : { address, bitrate, ...option };
  });
  const open = async () => {
    const body = target.peek();
    if (body === null || opening.peek()) return false;
    opening.value = true;
    refused.value = null;
    try {
      bus.value = await callApi("PUT", "/bus", { body, timeout_ms: OPENING_MS });
      return true;
    } catch (error) {
      const problem = problemOf(error);
      refused.value = { text: problemText(problem), command: problem.facts.command };
      return false;
    } finally {
      opening.value = false;
    }
  };
  return {
    adapters: signal(null),
    searchedAt: signal(monotonic()),
    listProblem: signal(null),
    chosen,
    typed,
    kbit,
    gap,
    role,
    opening,
    refused,
    target,
    open,
  };
}

const LEAST_KBIT = 10;
const MOST_KBIT = 1000;

/** Typed kbit/s as bit/s, or null. */
export function bitrateOf(typed: string): number | null {
  const value = parseNumber(typed, "kbit/s");
  return value !== null && value >= LEAST_KBIT && value <= MOST_KBIT ? Math.round(value * 1000) : null;
}

const MOST_GAP_MS = 20;

/** Typed frame gap in milliseconds, or null. */
export function gapOf(typed: string): number | null {
  const value = Number(typed.trim().replace(",", "."));
  return typed.trim() !== "" && value >= 0 && value <= MOST_GAP_MS ? value : null;
}

export function PickerCards({ picker }: { picker: Picker }) {
  const list = picker.adapters.value;
  const failed = picker.listProblem.value;
  const refused = picker.refused.value;
  // Adapters found would push everything below them out from under the pointer.
  if (list === null && failed === null) {
    return (
      <p class="small dim" role="status">
        {strings.searching}
      </p>
    );
  }
  return (
    <div class="picker">
      {failed !== null && <Note>{strings.failed(failed)}</Note>}
      {list?.every(isDemo) && (
        <div data-testid="no-adapter">
          <p class="strong">{strings.nothing}</p>
          <p class="second">{strings.nothingLine}</p>
          <ul class="adapter-checks" aria-label={strings.nothing}>
            {strings.checks.map(check => (
              <li key={check}>
                <Remedy text={check} />
              </li>
            ))}
          </ul>
          <Guides places={["adapters"]} />
        </div>
      )}
      <div role="radiogroup" aria-label={strings.adapters} class="adapters" data-testid="adapters">
        {(list ?? []).map(one => (
          <Card key={one.address} one={one} picker={picker} />
        ))}
        <Other picker={picker} />
      </div>
      <p class="small dim" data-testid="adapters-searched">
        {strings.searched(age(Math.max(0, now.value - picker.searchedAt.value), 0))}
      </p>
      <RolePart picker={picker} />
      <Options picker={picker} />
      <SwitchesOff picker={picker} />
      {picker.opening.value && picker.target.value?.address.startsWith(SERIAL) && (
        <p class="small second" role="status" data-testid="finding-rate">
          {strings.findingRate}
        </p>
      )}
      {refused && (
        <div class="refused" role="alert" data-testid="connect-refused">
          <Glyph kind="failure" size={14} />
          <Remedy text={refused.text} command={refused.command} />
        </div>
      )}
    </div>
  );
}

/** Says what happens to the simulated servos before the bus is changed. */
function SwitchesOff({ picker }: { picker: Picker }) {
  const here = bus.value;
  const target = picker.target.value;
  if (!here?.address?.startsWith(DEMO) || here.state === "disconnected") return null;
  if (target === null || target.address.startsWith(DEMO)) return null;
  return (
    <p class="switches-off" role="status" data-testid="switches-off">
      <Glyph kind="notice" size={14} /> {strings.switchesOff}
    </p>
  );
}

const GLYPH: Record<Adapter["state"], ConditionKind> = {
  ready: "ok",
  connected: "ok",
  down: "warning",
  wrong_bitrate: "warning",
  no_permission: "failure",
  in_use: "warning",
  no_driver: "offline",
};

function Card({ one, picker }: { one: Adapter; picker: Picker }) {
  const chosen = picker.chosen.value === one.address;
  const facts = [
    one.bitrate === null ? null : text.bar.bitrate(number(one.bitrate / 1e6, one.bitrate % 1e6 ? 3 : 0)),
    one.sample_point === null ? null : words.plot.pct(number(one.sample_point * 100, 1)),
    one.baud === null ? null : strings.lastBaud(grouped(one.baud)),
  ].filter(fact => fact !== null);
  return (
    <div class="adapter" data-usable={one.usable} data-chosen={chosen} data-testid={`adapter-${one.address}`}>
      <label>
        <input
          type="radio"
          name="adapter"
          checked={chosen}
          disabled={!one.usable}
          onChange={() => {
            picker.chosen.value = one.address;
            picker.refused.value = null;
          }}
        />
        <span class="adapter-name">
          <span class="strong">{isDemo(one) ? strings.demo : one.name}</span>
          {isDemo(one) ? (
            <small class="wraps">{strings.demoLine}</small>
          ) : (
            <small class="mono">{one.address}</small>
          )}
        </span>
        <span class="adapter-state">
          <Glyph kind={GLYPH[one.state]} />
          <span>
            <span class={one.usable ? "" : "strong"}>{strings.state[one.state]}</span>
            {facts.length > 0 && <small>{facts.join(text.comma)}</small>}
          </span>
        </span>
      </label>
      {one.state === "connected" && bus.value && !isDemo(one) && (
        <div class="adapter-why">
          <LineFacts state={bus.value} />
        </div>
      )}
      {(one.reason !== null || one.remedy !== null) && (
        <div class="adapter-why">
          <Remedy text={whyText(one)} command={one.params.command} />
        </div>
      )}
    </div>
  );
}

/** Why an adapter cannot be used, or a note on it, with the remedy. */
function whyText(one: Adapter): string {
  const strings = [one.reason, one.remedy].filter(part => part !== null).join(" ");
  return causeText({ ...one.params, cause: one.cause ?? "" }, strings);
}

function Other({ picker }: { picker: Picker }) {
  const chosen = picker.chosen.value === OTHER;
  const bitrate = bitrateOf(picker.kbit.value);
  const pick = () => {
    picker.chosen.value = OTHER;
    picker.refused.value = null;
  };
  return (
    <div class="adapter" data-usable data-chosen={chosen}>
      <label>
        <input type="radio" name="adapter" data-testid="adapter-other" checked={chosen} onChange={pick} />
        <span class="adapter-name">
          <span class="strong">{strings.other}</span>
          <small class="wraps">{strings.otherLine}</small>
        </span>
      </label>
      {chosen && (
        <div class="adapter-why">
          <TextField
            label={strings.address}
            hint={strings.example}
            at={cell(picker.typed.value, typed => {
              picker.typed.value = typed;
              picker.refused.value = null;
            })}
            beside
            testid="adapter-address"
          />
          <TextField
            label={strings.bitrate}
            at={picker.kbit}
            number
            unit={strings.bitrateUnit}
            beside
            short
            error={bitrate === null && strings.bitrateWrong(picker.kbit.value.trim() || "–")}
            help={bitrate === USUAL_BITRATE ? strings.bitrateLine : <b>{strings.bitrateOther}</b>}
            testid="adapter-bitrate"
          />
        </div>
      )}
    </div>
  );
}

const ROLES = ["auto", "host", "guest", "observer"] as const;

/** The connection role. Simulated servos share their bus with nobody. */
function RolePart({ picker }: { picker: Picker }) {
  if (picker.target.value?.address.startsWith(DEMO)) return null;
  return (
    <details class="adapter-options" data-testid="adapter-role" open={picker.role.value !== "auto"}>
      <summary>
        {roleWords.label}: {roleWords.name[picker.role.value]}
      </summary>
      <Roles options={ROLES} chosen={picker.role} />
    </details>
  );
}

/** Options for every adapter; collapsed, as they are rarely needed. */
function Options({ picker }: { picker: Picker }) {
  const wrong = gapOf(picker.gap.value) === null;
  return (
    <details class="adapter-options" data-testid="adapter-options">
      <summary>{strings.options}</summary>
      <TextField
        label={strings.gap}
        at={picker.gap}
        number
        unit="ms"
        beside
        short
        error={wrong && strings.gapWrong(picker.gap.value.trim() || "–")}
        help={strings.gapLine}
        testid="adapter-gap"
      />
    </details>
  );
}

export function ConnectButton({ picker, onOpen }: { picker: Picker; onOpen?: () => void }) {
  const target = picker.target.value;
  const picked = picker.adapters.value?.find(one => one.address === target?.address);
  const name = picked && isDemo(picked) ? strings.demoName : channelOf(target?.address);
  const open = async () => {
    if (await picker.open()) onOpen?.();
  };
  return (
    <Button
      look="primary"
      live
      testid="connect"
      disabled={target === null || picker.opening.value}
      onClick={() => void open()}
    >
      {picker.opening.value ? (
        <>
          <Spinner /> {strings.connecting(name)}
        </>
      ) : name === "" ? (
        strings.plain
      ) : (
        strings.connect(name)
      )}
    </Button>
  );
}
