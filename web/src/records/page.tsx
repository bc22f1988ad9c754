/** The Records page and its sections. */

import { go, pathOf } from "../bench/route";
import { Panel } from "../kit/panel";
import { Segments } from "../kit/segments";
import { partOf } from "./addresses";
import { Audit } from "./audit";
import { Inventory } from "./inventory";
import { Profiles } from "./profiles";
import { Reports } from "./reports";
import { Snapshots } from "./snapshots";
import { records as words } from "./words";
import "../kit/list.css";
import "../kit/table.css";
import "./records.css";

const PARTS = ["snapshots", "profiles", "reports", "audit"] as const;
type Part = (typeof PARTS)[number];

export function RecordsPage({ hash }: { hash: string }) {
  const { part, uid } = partOf<Part>(hash, PARTS);
  return (
    <div class="page list-page" data-testid="records-page" data-part={part}>
      <div class="page-head">
        <h1>{words.title}</h1>
        <Segments<Part>
          label={words.parts}
          chosen={part}
          onChoose={key => go(pathOf("records", null, key), true)}
          options={[
            { key: "snapshots", label: words.snapshotsTab },
            { key: "profiles", label: words.profilesTab },
            { key: "reports", label: words.reportsTab },
            { key: "audit", label: words.auditTab },
          ]}
        />
      </div>
      <Panel key={part}>
        {part === "snapshots" && (uid === null ? <Inventory /> : <Snapshots key={uid} uid={uid} />)}
        {part === "profiles" && <Profiles />}
        {part === "reports" && <Reports />}
        {part === "audit" && <Audit />}
      </Panel>
    </div>
  );
}
