/** Aliases of the generated JSON types of an autopilot's outputs. */
import type { components } from "./schema";

type Shapes = components["schemas"];

export type AutopilotPlan = Shapes["Plan"];
export type AutopilotProgram = AutopilotPlan["program"];
export type SentOutput = Shapes["PlanOutput"];
/** With all fields. */
export type PlanOutput = Required<Shapes["PlanOutput"]>;
export type AdviceItem = Shapes["AdviceItem"];
export type Verification = Shapes["Verification"];
export type VerifyRow = Shapes["VerifyRow"];
export type VerifyResult = VerifyRow["result"];
export type Failsafe = Shapes["Failsafe"];
