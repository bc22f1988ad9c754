/** Bands under the bar: no link, a stop that could not be sent, and the latched stop with its evidence. */
import { useSignal } from "@preact/signals";
import type { Stop } from "../api/types";
import { bus, leases, stop } from "../bench/bench";
import { now } from "../bench/clock";
import { findings } from "../bench/doctor";
import { nameOf, peekServo } from "../bench/fleet";
import { clock, number, withUnit } from "../bench/format";
import { holder, isOurs, who } from "../bench/holder";
import { link, up } from "../bench/link";
import { endMotion, keepMotion, membersOf, motion } from "../bench/motion";
import { those } from "../bench/release";
import { pathOf, route } from "../bench/route";
import { signedOut } from "../bench/session";
import { clearStop, unsent } from "../bench/stop";
import { begun } from "../change/flow";
import { outputLease, restorable } from "../change/restorable";
import type { RestoreProps } from "../change/restore-button";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { lazy } from "../kit/lazy";
import { HappenedLink } from "../servo/happened-link";
import { text } from "../text";

const ClearDialog = lazy<{ silent: readonly string[]; act: () => Promise<void>; onClose: () => void }>(() =>
  import("./clear-dialog").then(file => file.ClearDialog),
);
const RoleBand = lazy(() => import("../role/band").then(file => file.RoleBand));
const RestoreButton = lazy<RestoreProps>(() =>
  import("../change/restore-button").then(file => file.RestoreButton),
);
const StopAll = lazy(() => import("../role/stop-all").then(file => file.StopAll));
const HiddenChanges = lazy(() => import("../change/dialog").then(file => file.HiddenChanges));

export function Bands() {
  return (
    <div class="bands">
      <LinkBand />
      {unsent.value && (
        <div class="link-band unsent" role="alert">
          <Glyph kind="failure" />
          {up.value ? text.stop.unsentPast : unsent.value}
          {up.value && (
            <Button
              onClick={() => {
                unsent.value = null;
              }}
            >
              {text.close}
            </Button>
          )}
        </div>
      )}
      <ServerBand />
      <SilentBand />
      {stop.value?.latched && <StopBand stop={stop.value} />}
      <OutputBand />
      <RequestBand />
      {(bus.value?.role === "guest" || bus.value?.role === "observer") && <RoleBand />}
      {begun.value.length > 0 && <HiddenChanges />}
      <span class="hidden-text" role="status" data-testid="live-state" data-state={link.value.state}>
        {up.value ? text.link.up : text.link.down}
      </span>
    </div>
  );
}

function LinkBand() {
  const { state, since } = link.value;
  // Not signed in is not a lost link: the sign-in page shows what is missing.
  if (state === "up" || signedOut.value) return null;
  const waited = Math.max(0, Math.floor(now.value - since));
  if (state === "connecting" && waited < 1) return null;
  return (
    <div class="link-band" role="alert">
      <Glyph kind="warning" />
      {text.link.lost(waited)}
    </div>
  );
}

/** A failure of the server itself, which no other page would show. The Bus page has evidence and remedy. */
function ServerBand() {
  const failed = findings.value.find(one => one.severity === "failure" && one.code in text.serverFailure);
  if (failed === undefined || !up.value) return null;
  return (
    <div class="link-band" role="alert" data-testid="server-band">
      <Glyph kind="failure" />
      <a href={pathOf("bus", null)}>{text.serverFailure[failed.code as keyof typeof text.serverFailure]}</a>
    </div>
  );
}

/** Servos that have not acknowledged torque off, on any page. A latched stop lists them itself. */
function SilentBand() {
  const silent = those("silent");
  if (silent.length === 0 || stop.value?.latched) return null;
  const names = silent.map(uid => nameOf(peekServo(uid))).join(", ");
  return (
    <div class="link-band" role="alert" data-testid="silent-band">
      <Glyph kind="warning" />
      {text.motion.torqueNotConfirmed(names)}
    </div>
  );
}

/** Outputs that this page keeps on under its lease, where no motion band of the page says so. */
function OutputBand() {
  const present = motion.value;
  const { page, uid } = route.value;
  if (present.phase !== "on" || present.lease !== outputLease.value) return null;
  if (uid === present.uid && (page === "motion" || page === "tune")) return null;
  return (
    <section class="link-band prompt" data-testid="kept-band">
      <Button testid="kept-off" onClick={() => endMotion(null)}>
        {text.motion.turnOff}
      </Button>
      <span>{text.output.keptOn(membersOf(present).length)}</span>
    </section>
  );
}

/** A request for the motion control of this page. Its buttons are at the left, away from Stop. */
function RequestBand() {
  const phase = motion.value.phase;
  const held = leases.value.find(one => isOurs(one) && one.request);
  const requested = held?.request;
  if ((phase !== "on" && phase !== "held") || !held || !requested) return null;
  const left = Math.max(0, Math.ceil((held.passesAt ?? now.value) - now.value));
  return (
    <section class="link-band prompt" data-testid="request-band" aria-label={text.request.label}>
      <span class="prompt-buttons">
        <Button testid="keep-lease" live onClick={() => void keepMotion(requested.id)}>
          {text.request.keep}
        </Button>
        <Button testid="hand-over" onClick={() => endMotion(text.request.handedOver(who(requested.by)))}>
          {text.request.handOver}
        </Button>
      </span>
      <span>
        {/* Announced once, not every second. */}
        <span role="alert">{text.request.wants(who(requested.by), requested.reason)}</span>{" "}
        <span class="second" data-testid="request-left">
          {text.request.passes(left)}
        </span>
      </span>
    </section>
  );
}

type Stopped = { name: string; confirmed: boolean; ms: number | null };

/** Servos by name, and nodes that may be servos by node ID. */
function stoppedNodes(stop: Stop): Stopped[] {
  return [
    ...stop.servos.map(one => ({ ...one, name: one.label || one.uid.slice(0, 8) })),
    ...(stop.nodes ?? []).map(one => ({ ...one, name: text.stop.node(one.node_id) })),
  ];
}

function names(stopped: Stopped[]): string {
  return stopped.map(one => one.name).join(", ");
}

function StopBand({ stop }: { stop: Stop }) {
  const confirming = useSignal(false);
  const problem = useSignal<string | null>(null);
  const all = stoppedNodes(stop);
  const silent = all.filter(one => !one.confirmed);
  const times = all.flatMap(one => (one.confirmed && one.ms !== null ? [one.ms] : []));
  const clear = async () => {
    confirming.value = false;
    problem.value = await clearStop();
  };
  return (
    <section class="stop-band" role="alert" data-testid="stop-band">
      <Button
        look="danger"
        testid="clear-stop"
        live
        onClick={() => {
          confirming.value = true;
        }}
      >
        {text.stop.clear}
      </Button>
      {restorable.value.length > 0 && (
        <RestoreButton
          uids={null}
          testid="restore-all"
          onRefused={why => {
            problem.value = why;
          }}
        />
      )}
      {bus.value?.role === "guest" && <StopAll />}
      <div class="said">
        <h2>
          {text.stop.headline(
            clock(stop.at ?? Date.now() / 1000),
            stop.by ? text.stop.by(stop.by === holder() ? text.stop.you : who(stop.by)) : "",
            all.length - silent.length,
            all.length,
            stop.mode === "brake" ? text.stop.brake : text.stop.off,
            stop.reach,
          )}
        </h2>
        <p class="second">
          {silent.length === 1 && text.stop.silent(names(silent))}
          {silent.length > 1 && text.stop.silentMany(names(silent))}
          {problem.value ?? text.stop.stays} {stop.at != null && <HappenedLink from={stop.at} to={stop.at} />}
        </p>
      </div>
      <p class="evidence touch-hide">
        {times.length > 0 && (
          <>
            {text.stop.first} <b>{ms(Math.min(...times))}</b>
            <br />
            {text.stop.last} <b>{ms(Math.max(...times))}</b>
          </>
        )}
        {silent.length > 0 && (
          <>
            <br />
            {text.stop.repeating(names(silent))}
          </>
        )}
      </p>
      {confirming.value && (
        <ClearDialog
          silent={silent.map(one => one.name)}
          act={clear}
          onClose={() => {
            confirming.value = false;
          }}
        />
      )}
    </section>
  );
}

function ms(value: number): string {
  return withUnit(number(value, value < 10 ? 1 : 0), "ms");
}
