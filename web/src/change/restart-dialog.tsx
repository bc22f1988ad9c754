/** The question before restarts: what is lost, what each horn does, that it can turn freely; then the restarts, step by step. */
import { useSignal } from "@preact/signals";
import type { RestartPreview } from "../api/config-types";
import { nameOf, servo } from "../bench/fleet";
import { NONE } from "../bench/format";
import { rowLabelOf } from "../bench/row-text";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { text } from "../text";
import { restarting as words } from "../text/topics";
import { BeforeAfter } from "./before-after";
import { HornForecast, hornLine } from "./horn-forecast";
import { HornFreeTick, useHornFree } from "./horn-free";
import { ServoJobDialog } from "./servo-job-dialog";
import { runInTurn } from "./servo-jobs";
import "../kit/table.css";
import "./restarting.css";

const said = words.restart;

export interface Planned {
  uid: string;
  plan: RestartPreview;
}

interface Props {
  plans: readonly Planned[];
  /** Why others that were asked for are not restarted. */
  leftOut?: readonly string[];
  onClose: () => void;
}

export function RestartDialog({ plans, leftOut = [], onClose }: Props) {
  const free = useHornFree(plans.map(one => ({ uid: one.uid, moves: one.plan.restart.moves })));
  const going = useSignal(false);
  if (going.value) return <ServoJobDialog onClose={onClose} />;
  const [first] = plans;
  const alone = plans.length === 1 && leftOut.length === 0 ? servo(first?.uid ?? null) : undefined;
  const name = nameOf(servo(first?.uid ?? null));
  return (
    <Dialog
      title={plans.length === 1 ? said.title(name) : said.titleAll(plans.length)}
      subtitle={
        alone
          ? words.facts(alone.model ?? NONE, alone.serial ?? NONE, String(alone.servo_id ?? NONE))
          : said.inTurn
      }
      testid="restart-dialog"
      onClose={onClose}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={onClose}>{text.cancel}</Button>
          </span>
          <Button
            look="primary"
            live
            testid="restart-go"
            disabled={!free.agreed}
            onClick={() => {
              going.value = true;
              void runInTurn(
                "restart",
                plans.map(one => one.uid),
              );
            }}
          >
            {plans.length === 1 ? said.go(name) : said.goAll(plans.length)}
          </Button>
        </>
      }
    >
      {alone && first ? (
        <>
          <HornForecast one={alone} forecast={first.plan.restart} verb="restart" />
          <Lost plan={first.plan} />
        </>
      ) : (
        <Table plans={plans} />
      )}
      {leftOut.length > 0 && (
        <div>
          <h3>{said.leftOut}</h3>
          <ul class="refusals small">
            {leftOut.map(line => (
              <li key={line}>
                <Glyph kind="failure" size={13} /> {line}
              </li>
            ))}
          </ul>
        </div>
      )}
      <HornFreeTick of={free} />
    </Dialog>
  );
}

function Lost({ plan }: { plan: RestartPreview }) {
  if (plan.lost.length === 0) return <p data-testid="nothing-lost">{said.nothingLost}</p>;
  return (
    <div data-testid="lost">
      <p>
        <b>{said.lost(plan.lost.length)}.</b> <span class="second">{said.lostHint}</span>
      </p>
      <BeforeAfter
        head={{ parameter: said.head.parameter, now: said.head.ram, next: said.head.rom }}
        changes={plan.lost.map(one => ({ key: one.key, now: one.before, next: one.requested }))}
        testid="lost"
      />
    </div>
  );
}

function Table({ plans }: { plans: readonly Planned[] }) {
  return (
    <table class="changes restarts">
      <thead>
        <tr>
          <th>{said.table.servo}</th>
          <th>{said.table.horn}</th>
          <th>{said.table.lost}</th>
        </tr>
      </thead>
      <tbody>
        {plans.map(({ uid, plan }) => (
          <tr key={uid} data-testid={`restart-${uid}`}>
            <td class="strong">{nameOf(servo(uid))}</td>
            <td class={plan.restart.moves ? "" : "second"}>{hornLine(plan.restart)}</td>
            <td class={plan.lost.length > 0 ? "strong" : "second"}>
              {plan.lost.map(one => rowLabelOf(one.key)).join(", ") || said.none}
            </td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
