/** The side panel of the scope: channels, trigger, cursor table, overlays, layouts. */
import { type Signal, useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import type { TelemetryGrant } from "../api/types";
import { catalog } from "../bench/catalog";
import { nameOf, servo, uids } from "../bench/fleet";
import { number } from "../bench/format";
import { Button } from "../kit/button";
import { Choice, cell, TextField } from "../kit/field";
import { Segments } from "../kit/segments";
import { channelsOf } from "../plots/channels";
import type { TimeSpan } from "../plots/span";
import { arm, type ScopeCurve } from "./acquire";
import { Letter } from "./cursor-table";
import { idOf, MOST_CHANNELS } from "./layout";
import type { ScopeOverlay } from "./overlay";
import {
  acquisition,
  applyLayout,
  channels,
  hidden,
  layouts,
  removeLayout,
  rule,
  saveLayout,
  source,
} from "./state";
import { EDGES, type Edge, type TriggerRule } from "./trigger";
import { scope as words } from "./words";

interface Props {
  span: TimeSpan;
  curves: readonly (ScopeCurve & { label: string })[];
  grants: ReadonlyMap<string, TelemetryGrant>;
  overlays: Signal<readonly ScopeOverlay[]>;
  requested: number;
  windowed: number;
  children: ComponentChildren;
}

export function ScopeSide(props: Props) {
  return (
    <aside class="scope-side" aria-label={words.channels}>
      <Channels {...props} />
      <Trigger span={props.span} curves={props.curves} />
      {props.children}
      <Layouts span={props.span} windowed={props.windowed} />
    </aside>
  );
}

function Channels({ curves, grants, overlays, requested }: Props) {
  const uid = useSignal("");
  const key = useSignal("");
  const offered = channelsOf(catalog.value?.rows.values() ?? [], null);
  const whose = uid.value || uids.value[0] || "";
  const what = key.value || offered[0]?.key || "";
  const taken = channels.value.some(one => one.uid === whose && one.channel === what);
  return (
    <section aria-label={words.channels}>
      <header>
        <h2>{words.channels}</h2>
        <span class="small second">{words.count(channels.value.length, MOST_CHANNELS)}</span>
      </header>
      <ul class="scope-channels">
        {curves.map(one => {
          const id = idOf(one);
          const grant = grants.get(one.uid);
          const name = `${one.letter}, ${one.label}, ${one.name}`;
          return (
            <li key={id} data-testid={`scope-channel-${one.letter}`}>
              <Letter curve={one} />
              <span class="scope-channel">
                {one.label}
                <span class="small second">{one.name}</span>
              </span>
              <span class="small second">
                {grant ? words.rate(number(grant.granted_hz, 0), number(requested, 0)) : words.waitingFor}
              </span>
              <button
                type="button"
                class="tool"
                aria-label={words.hide(name)}
                aria-pressed={hidden.value.has(id)}
                onClick={() => {
                  const next = new Set(hidden.peek());
                  if (!next.delete(id)) next.add(id);
                  hidden.value = next;
                }}
              >
                {hidden.value.has(id) ? "○" : "●"}
              </button>
              <button
                type="button"
                class="tool"
                aria-label={words.remove(name)}
                onClick={() => {
                  channels.value = channels.peek().filter(each => idOf(each) !== id);
                  if (source.peek() === id) source.value = null;
                }}
              >
                ×
              </button>
            </li>
          );
        })}
        {overlays.value.map(one => (
          <li key={one.name}>
            <span class="scope-channel">{one.name}</span>
            <button
              type="button"
              class="tool"
              aria-label={words.overlayRemove(one.name)}
              onClick={() => {
                overlays.value = overlays.peek().filter(each => each !== one);
              }}
            >
              ×
            </button>
          </li>
        ))}
      </ul>
      <div class="scope-row">
        <Choice
          bare
          label={words.servo}
          testid="scope-add-servo"
          at={cell(whose, next => {
            uid.value = next;
          })}
          options={uids.value.map(one => ({ key: one, label: nameOf(servo(one)) }))}
        />
        <Choice
          bare
          label={words.channel}
          testid="scope-add-channel"
          at={cell(what, next => {
            key.value = next;
          })}
          options={offered.map(one => ({ key: one.key, label: one.label }))}
        />
        <Button
          testid="scope-add"
          disabled={taken || whose === "" || channels.value.length >= MOST_CHANNELS}
          onClick={() => {
            channels.value = [...channels.peek(), { uid: whose, channel: what }];
          }}
        >
          {words.add}
        </Button>
      </div>
    </section>
  );
}

function Trigger({ span, curves }: Pick<Props, "span" | "curves">) {
  const unit = curves.find(one => idOf(one) === source.value)?.unit ?? "";
  const set = (change: Partial<TriggerRule>) => {
    rule.value = { ...rule.peek(), ...change };
    if (source.peek() !== null) arm(span);
  };
  return (
    <section aria-label={words.trigger}>
      <header>
        <h2>{words.trigger}</h2>
        <span class="grow" />
        <Button testid="scope-arm" disabled={source.value === null} onClick={() => arm(span)}>
          {words.arm} <kbd>T</kbd>
        </Button>
      </header>
      <div class="scope-row">
        <Choice
          bare
          label={words.source}
          testid="scope-source"
          at={cell(source.value ?? "", next => {
            source.value = next === "" ? null : next;
            acquisition.value = { state: "free" };
            span.follow();
          })}
          options={[
            { key: "", label: words.none },
            ...curves.map(one => ({ key: idOf(one), label: `${one.letter}, ${one.label}` })),
          ]}
        />
        <Segments<Edge>
          label={words.edge}
          chosen={rule.value.edge}
          onChoose={edge => set({ edge })}
          options={EDGES.map(key => ({ key, label: words.edges[key] }))}
        />
      </div>
      <div class="scope-row">
        <Figure
          label={words.level}
          unit={unit}
          value={rule.value.level}
          testid="scope-level"
          put={level => set({ level })}
        />
        <Figure
          label={words.before}
          unit="%"
          value={100 * rule.value.before}
          testid="scope-before"
          put={value => set({ before: Math.min(1, Math.max(0, value / 100)) })}
        />
        <Figure
          label={words.holdoff}
          unit="s"
          value={rule.value.holdoff}
          testid="scope-holdoff"
          put={value => set({ holdoff: Math.max(0, value) })}
        />
      </div>
    </section>
  );
}

interface FigureProps {
  label: string;
  unit: string;
  value: number;
  testid: string;
  put: (value: number) => void;
}

function Figure({ label, unit, value, testid, put }: FigureProps) {
  const typed = useSignal<string | null>(null);
  const read = (text: string) =>
    text.trim() === "" ? Number.NaN : Number(text.replace("−", "-").replace(",", "."));
  const wrong = typed.value !== null && !Number.isFinite(read(typed.value));
  return (
    <TextField
      label={label}
      testid={testid}
      unit={unit}
      error={wrong ? words.wrong : null}
      at={cell(typed.value ?? String(value), next => {
        typed.value = next;
        if (Number.isFinite(read(next))) put(read(next));
      })}
    />
  );
}

function Layouts({ span, windowed }: { span: TimeSpan; windowed: number }) {
  const name = useSignal("");
  return (
    <section aria-label={words.layouts}>
      <header>
        <h2>{words.layouts}</h2>
      </header>
      <ul class="scope-channels">
        {layouts.value.map(one => (
          <li key={one.name}>
            <button
              type="button"
              class="tool scope-channel"
              onClick={() => {
                applyLayout(one.layout);
                span.choose(one.layout.seconds);
              }}
            >
              {one.name}
              <span class="small second">{words.layoutOf(one.layout.channels.length)}</span>
            </button>
            <button
              type="button"
              class="tool"
              aria-label={words.layoutRemove(one.name)}
              onClick={() => removeLayout(one.name)}
            >
              ×
            </button>
          </li>
        ))}
      </ul>
      <div class="scope-row">
        <TextField
          bare
          label={words.layoutName}
          testid="scope-layout-name"
          hint={words.layoutName}
          at={name}
        />
        <Button
          testid="scope-save"
          disabled={name.value.trim() === "" || channels.value.length === 0}
          onClick={() => {
            saveLayout(name.peek().trim(), windowed);
            name.value = "";
          }}
        >
          {words.save}
        </Button>
      </div>
      <p class="small second">{words.layoutsHint}</p>
    </section>
  );
}
