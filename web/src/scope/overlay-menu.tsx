/** The overlay menu: a file, or one of the last runs of the servos shown. */
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { callApi, problemOf } from "../api/client";
import type { StepRun } from "../api/lab-types";
import { problemText } from "../bench/facts";
import { nameOf, servo } from "../bench/fleet";
import { signed, withUnit } from "../bench/format";
import { connection } from "../bench/link";
import { instant } from "../kit/loaded";
import { Menu } from "../kit/menu";
import { fromCsv } from "../telemetry/csv";
import type { ScopeChannel } from "./layout";
import { overlayOfRun, type ScopeOverlay } from "./overlay";
import { scope as words } from "./words";

/** Number of runs offered per servo. */
const OFFERED = 5;

interface Props {
  channels: readonly ScopeChannel[];
  onOverlay: (one: ScopeOverlay) => void;
  onProblem: (why: string | null) => void;
}

export function OverlayMenu({ channels, onOverlay, onProblem }: Props) {
  const input = useRef<HTMLInputElement>(null);
  const runs = useSignal<readonly StepRun[]>([]);
  const uids = [...new Set(channels.map(one => one.uid))];
  const round = connection.value;
  useEffect(() => {
    if (round === 0) return;
    const all = uids.map(uid => callApi("GET", "/runs", { query: { uid, limit: OFFERED } }));
    Promise.all(all).then(
      found => {
        runs.value = found.flat().sort((a, b) => b.at - a.at);
      },
      error => onProblem(problemText(problemOf(error))),
    );
  }, [uids.join(" "), round]);
  const layFile = async (file: File) => {
    const content = fromCsv(await file.text());
    const fits = content?.columns.some(one => channels.some(each => one.head.endsWith(each.channel)));
    onProblem(content && fits ? null : words.overlayNone(file.name));
    if (content && fits) onOverlay({ name: file.name, content });
  };
  const layRun = async (run: StepRun) => {
    onProblem(null);
    try {
      const whole = await callApi("GET", "/runs/{run_id}", { path: { run_id: run.id } });
      const laid = overlayOfRun(whole, words.run(instant(run.at)), nameOf(servo(run.uid)));
      if (laid) onOverlay(laid);
    } catch (error) {
      onProblem(problemText(problemOf(error)));
    }
  };
  return (
    <>
      <Menu label={words.overlayTitle} word={words.overlay} testid="scope-overlay-menu">
        {[
          {
            key: "file",
            label: words.overlayFile,
            line: words.overlayFileLine,
            act: () => input.current?.click(),
          },
          ...runs.value.map(run => ({
            key: `run-${run.id}`,
            label: `${words.run(instant(run.at))}, ${nameOf(servo(run.uid))}`,
            line: [words.runStep(withUnit(signed(run.step_deg, 1), "°")), run.note]
              .filter(Boolean)
              .join(", "),
            act: () => void layRun(run),
          })),
        ]}
      </Menu>
      <input
        ref={input}
        type="file"
        accept=".csv"
        class="hidden-text"
        tabIndex={-1}
        aria-label={words.overlayFile}
        data-testid="scope-overlay"
        onChange={event => {
          const file = event.currentTarget.files?.[0];
          event.currentTarget.value = "";
          if (file) void layFile(file);
        }}
      />
    </>
  );
}
