/** The column beside the curves: Improve, gains and mechanics, or the running job in their place. */
import type { KnownServo } from "../bench/fleet";
import { oneInAddress } from "../bench/route";
import { tabKeys } from "../kit/tab-keys";
import { TuneGains } from "./gains";
import { ImprovePart } from "./improve";
import { JobPart } from "./job";
import { MechanicsPart } from "./mechanics";
import { test, testing, testProblem } from "./state";
import { tune as words } from "./words";

const PARTS = ["improve", "gains", "mechanics"] as const;

const part = oneInAddress("part", PARTS);

export function TuneColumn({ one }: { one: KnownServo }) {
  const strings = words.column;
  const running = testing.value || test.value !== null || testProblem.value !== null;
  return (
    <aside class="tune-column" aria-label={strings.label} data-testid="tune-column">
      {running ? (
        <JobPart one={one} />
      ) : (
        <>
          <div class="tune-parts" role="tablist" aria-label={strings.label} tabIndex={-1} onKeyDown={tabKeys}>
            {PARTS.map(key => (
              <button
                key={key}
                type="button"
                role="tab"
                id={`tune-tab-${key}`}
                aria-selected={part.value === key}
                aria-controls="tune-part"
                data-testid={`tune-tab-${key}`}
                onClick={() => {
                  part.value = key;
                }}
              >
                {strings[key]}
              </button>
            ))}
          </div>
          <div id="tune-part" role="tabpanel" aria-labelledby={`tune-tab-${part.value}`}>
            {part.value === "improve" && <ImprovePart one={one} />}
            {part.value === "gains" && <TuneGains uid={one.uid} />}
            {part.value === "mechanics" && <MechanicsPart one={one} />}
          </div>
        </>
      )}
    </aside>
  );
}
