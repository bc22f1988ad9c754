/** The page's names for the JSON shapes of step tests and of the recorder: aliases of the generated document. */
import type { components } from "./schema";

type Shapes = components["schemas"];

export type StepTestWish = Shapes["StepTest"];
export type StepMetrics = Shapes["StepMetrics"];
export type StepTrace = Shapes["StepTrace"];
export type StepRun = Shapes["StepRun"];
export type RunOverlay = Shapes["RunOverlay"];
export type RecorderState = Shapes["RecorderState"];
export type Recording = Shapes["Recording"];
export type RecordingMark = Recording["marks"][number];
export type RecordingContent = Shapes["RecordingContent"];
export type RecordingColumns = RecordingContent["telemetry"][number];
