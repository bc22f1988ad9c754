/** Aliases of the generated JSON types of the server. */
import type { components } from "./schema";

type Shapes = components["schemas"];

export type Servo = Shapes["Servo"];
export type ServoState = Servo["state"];
export type Reading = Shapes["Reading"];
/** An engineering value, the key of a choice, or null for inactive or unknown. */
export type Value = Reading["value"];
export type ParameterKey = Shapes["ParameterKey"];
export type Change = Shapes["Change"];
export type ParametersPatched = Shapes["ParametersPatched"];
export type Job = Shapes["Job"];
export type JobStep = Shapes["JobStep"];
export type RunPlan = Shapes["RunPlan"];
export type PlanStep = RunPlan["steps"][number];
export type PlanPreview = Shapes["PlanPreview"];
export type StepCode = JobStep["code"];
export type EvidenceCode = NonNullable<JobStep["evidence_code"]>;
/** Params of a text, by name with unit. */
export type Params = Shapes["Params"];
export type ProblemBody = Shapes["Problem"];
export type Commanded = Shapes["Commanded"];
export type Stream = Shapes["Stream"];
export type TorqueMode = Shapes["TorqueMode"]["mode"];
export type TelemetryGrant = Shapes["TelemetryGrant"];
export type Lease = Shapes["Lease"];
export type LeaseView = Shapes["LeaseView"];
export type TakeOverState = Shapes["TakeOverState"];
export type Caution = Shapes["Caution"];
export type Fault = Shapes["Fault"];
export type Stop = Shapes["Stop"];
export type OutputRestorePreview = Shapes["OutputRestorePreview"];
export type StopServo = Shapes["StopServo"];
export type Bus = Shapes["Bus"];
export type PendingAllocation = Shapes["PendingAllocation"];

/** One row of the parameter table; its numbers are raw. */
export type Row = Shapes["Parameter"];
export type FaultRow = Pick<Shapes["FaultBit"], "level" | "bit" | "key" | "label" | "advice">;
/** The part of GET /schema that the page uses. */
export type Schema = Pick<Shapes["SchemaDocument"], "revision" | "groups" | "parameters" | "faults">;

export type ServerMessage = Shapes["ServerMessage"];
export type ClientMessage = Shapes["ClientMessage"];
export type EventLevel = Shapes["EventMessage"]["level"];
export type LeftOut = Shapes["LeftOut"];
export type NoteCode = LeftOut["why_code"];
export type EventCode = Shapes["EventMessage"]["code"];
/** Trigger of a recording. */
export type MarkReason = Shapes["RecordingMark"]["reason"];
export type RefusalCode = NonNullable<PendingAllocation["refusal_code"]>;
export type Parameters = Shapes["Parameters"];
