/** The page's names for the JSON shapes of step tests and of the recorder: aliases of the generated document. */
import type { components } from "./schema";

type Shapes = components["schemas"];

export type StepTestWish = Shapes["StepTest"];
export type StepMetrics = Shapes["StepMetrics"];
export type StepTrace = Shapes["StepTrace"];
export type StepRun = Shapes["StepRun"];
export type RunOverlay = Shapes["RunOverlay"];
export type RecorderState = Shapes["RecorderState"];
export type Bundle = Shapes["Bundle"];
export type BundleMark = Bundle["marks"][number];
export type BundleContent = Shapes["BundleContent"];
export type BundleColumns = BundleContent["telemetry"][number];
