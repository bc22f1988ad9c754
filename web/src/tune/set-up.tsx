/** The set-up of a servo: one sentence in the column, and the dialog that changes it. */
import { useSignal } from "@preact/signals";
import type { SetUp } from "../api/lab-types";
import { signed } from "../bench/format";
import { parseNumber } from "../bench/number";
import { Confirm } from "../kit/confirm";
import { Choice, TextField } from "../kit/field";
import { Note } from "../kit/note";
import { closeDialog, dialog } from "./dialogs";
import { setUpText } from "./set-up-text";
import { overlay, setUp, storeSetUp } from "./state";
import { letter } from "./step-runs";
import { tune as words } from "./words";

export function SetUpPart() {
  const strings = words.setUp;
  const present = setUp.value;
  const text = present && setUpText(present);
  return (
    <section class="tune-part" aria-label={strings.title} data-testid="set-up">
      <header>
        <h2>{strings.title}</h2>
        <button
          type="button"
          class="link"
          data-testid="set-up-change"
          disabled={present === null}
          onClick={() => {
            dialog.value = "set-up";
          }}
        >
          {strings.change}
        </button>
      </header>
      <p class="second small">
        {text ? `${text}. ` : `${strings.notStated} `}
        {sameIn()}
      </p>
    </section>
  );
}

/** "The same for A and B", if the shown runs were made with the present set-up. */
function sameIn(): string {
  const shown = overlay.value?.runs ?? [];
  const present = setUpText(setUp.value ?? {});
  if (shown.length === 0 || present === null) return "";
  const same = shown.flatMap((run, place) => (setUpText(run.set_up) === present ? letter(place) : []));
  const other = shown.flatMap((run, place) => (setUpText(run.set_up) === present ? [] : letter(place)));
  if (other.length > 0) return words.setUp.otherFor(other);
  return words.setUp.sameFor(same);
}

type Key = "arm_mm" | "mass_g" | "inertia_gm2" | "load_nm" | "supply_v" | "ambient_c";

/** Range of each value, as in the API. */
const FIELDS: readonly { key: Key; unit: string; low: number; high: number }[] = [
  { key: "arm_mm", unit: "mm", low: 0.001, high: 1000 },
  { key: "mass_g", unit: "g", low: 0.001, high: 20_000 },
  { key: "inertia_gm2", unit: "g·m²", low: 0, high: 1000 },
  { key: "load_nm", unit: "N·m", low: -50, high: 50 },
  { key: "supply_v", unit: "V", low: 0.001, high: 60 },
  { key: "ambient_c", unit: "°C", low: -60, high: 120 },
];

const MOUNTINGS = ["bench", "vice", "vehicle", "other"] as const;

export function SetUpDialog({ uid }: { uid: string }) {
  const strings = words.setUp;
  const present = setUp.peek() ?? {};
  const texts = useSignal<Record<string, string>>(
    Object.fromEntries(
      FIELDS.map(({ key }) => {
        const value = present[key];
        if (value === null || value === undefined) return [key, ""];
        return [key, key === "load_nm" ? signed(value, decimalsOf(value)) : String(value)];
      }),
    ),
  );
  const mounting = useSignal<string>(present.mounting ?? "");
  const found = Object.fromEntries(
    FIELDS.map(({ key, unit, low, high }) => [key, read(texts.value[key] ?? "", unit, low, high)]),
  ) as Record<Key, number | null | undefined>;
  const both = found.inertia_gm2 != null && (found.arm_mm != null || found.mass_g != null);
  const wrong = FIELDS.find(({ key }) => found[key] === undefined);
  const act = () =>
    storeSetUp(uid, {
      ...(found as Record<Key, number | null>),
      mounting: MOUNTINGS.find(one => one === mounting.value) ?? null,
    } satisfies SetUp);
  return (
    <Confirm
      title={strings.dialogTitle}
      subtitle={strings.dialogLead}
      verb={strings.save}
      ready={wrong === undefined && !both}
      testid="set-up-dialog"
      actId="set-up-save"
      act={act}
      onClose={closeDialog}
    >
      <div class="tune-fields set-up-fields">
        {FIELDS.map(({ key, unit }) => (
          <TextField
            key={key}
            label={strings.fields[key]}
            unit={unit}
            number
            at={{
              get value() {
                return texts.value[key] ?? "";
              },
              set value(next) {
                texts.value = { ...texts.value, [key]: next };
              },
            }}
            error={found[key] === undefined}
            testid={`set-up-${key}`}
          />
        ))}
        <Choice
          label={strings.mounting}
          at={mounting}
          testid="set-up-mounting"
          options={[
            { key: "", label: strings.unknown },
            ...MOUNTINGS.map(key => ({ key, label: strings.mountings[key] })),
          ]}
        />
      </div>
      {both && <Note kind="warning">{strings.oneInertia}</Note>}
      {wrong && <Note kind="warning">{strings.between(strings.fields[wrong.key], range(wrong))}</Note>}
    </Confirm>
  );
}

/** Null if empty, undefined if invalid. */
function read(typed: string, unit: string, low: number, high: number): number | null | undefined {
  if (typed.trim() === "") return null;
  const value = parseNumber(typed, unit);
  return value === null || value < low || value > high ? undefined : value;
}

function range({ low, high, unit }: (typeof FIELDS)[number]): string {
  return words.setUp.range(String(low > 0 ? 0 : low).replace("-", "−"), `${high}\u202f${unit}`);
}

function decimalsOf(value: number): number {
  return (String(value).split(".")[1] ?? "").length;
}
