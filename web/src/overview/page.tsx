/** The Overview of one servo: what it does now, what is known, and actions. */
import { useEffect } from "preact/hooks";
import { servo } from "../bench/fleet";
import { connection } from "../bench/link";
import { sheetOf } from "../bench/parameters";
import { watch } from "../bench/telemetry-subscription";
import { Panel } from "../kit/panel";
import { Act } from "./act";
import { Know } from "./know";
import { Now } from "./now";
import "./overview.css";

export function OverviewPage({ uid }: { uid: string }) {
  const one = servo(uid);
  const round = connection.value;
  const ready = one?.online === true && one.state !== "identifying" && one.state !== "restarting";
  // Read after each connection, restart and identification.
  useEffect(() => {
    if (round > 0) void sheetOf(uid).load();
  }, [uid, round, ready]);
  useEffect(() => watch(uid), [uid]);
  if (!one) return null;
  return (
    <div class="overview scroll" data-testid="overview-page">
      <Panel>
        <Now one={one} />
      </Panel>
      <Know one={one} />
      <Panel>
        <Act one={one} />
      </Panel>
    </div>
  );
}
