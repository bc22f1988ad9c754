/** Aliases of the generated JSON types of the bus. */
import type { components } from "./schema";

type Shapes = components["schemas"];

export type AllocatorState = Shapes["AllocatorState"];
export type AllocatorMode = AllocatorState["mode"];
export type Allocation = Shapes["Allocation"];
export type AllocationChange = Shapes["AllocationChange"];
export type FrameFilter = Shapes["FrameFilter"];
export type FramesMessage = Shapes["FramesMessage"];
export type RawFrame = Shapes["RawFrame"];
export type DecodedTransfer = Shapes["DecodedTransfer"];
export type Adapter = Shapes["Adapter"];
export type Finding = Shapes["Finding"];
export type FindingCode = Finding["code"];
export type Advice = NonNullable<Finding["advice"]>;
export type BusNode = Shapes["Node"];
export type LogState = Shapes["LogState"];
export type LogFormat = NonNullable<Shapes["LogRequest"]["format"]>;
export type LogFile = Shapes["LogFile"];
