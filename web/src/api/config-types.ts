/** Aliases of the generated JSON types of configuration. */
import type { components } from "./schema";

type Shapes = components["schemas"];

export type Candidate = Shapes["Candidate"];
export type Candidates = Shapes["Candidates"];
export type Commissioning = Shapes["Commissioning"];
export type CommissioningPreview = Shapes["CommissioningPreview"];
export type CommissionPlan = Shapes["CommissionPlan"];
export type SafetyWord = NonNullable<Commissioning["confirm"]>[number];
export type SavePreview = Shapes["SavePreview"];
export type OnAnomaly = NonNullable<Commissioning["on_anomaly"]>;
export type Forecast = Shapes["Forecast"];
export type ForecastWarning = Shapes["ForecastWarning"];
export type RestartPreview = Shapes["RestartPreview"];
export type ResetPreview = Shapes["ResetPreview"];
export type Profile = Shapes["Profile"];
export type LineVerdict = Shapes["LineVerdict"];
export type Snapshot = Shapes["Snapshot"];
export type ReasonCode = NonNullable<Snapshot["reason_code"]>;
export type Comparison = Shapes["Comparison"];
export type Difference = Shapes["Difference"];
export type Restored = Shapes["Restored"];
export type Drift = Shapes["Drift"];
export type DriftRow = Shapes["DriftRow"];
export type InventoryServo = Shapes["KnownServo"];
export type AuditRow = Shapes["AuditRow"];
export type BatchOutcome = Shapes["BatchOutcome"];
export type BatchRead = Shapes["BatchRead"];
export type BatchPatched = Shapes["BatchPatched"];
export type Bench = Shapes["SiteBench"];
