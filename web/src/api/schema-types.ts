/** What programs rely on in the generated types, checked by the compiler: each row has its type, alone and in the set. */
import type { components, paths } from "./schema";

type Same<A, B> = (<T>() => T extends A ? 1 : 2) extends <T>() => T extends B ? 1 : 2 ? true : false;
type Whole = paths["/api/v1/servos/{uid}/parameters"]["get"]["responses"][200]["content"]["application/json"];
type Gain = paths["/api/v1/servos/{uid}/parameters/angle_p_gain"]["get"]["responses"][200]["content"];
type One = Gain["application/json"];
type Row<K extends keyof Whole["parameters"]> = NonNullable<Whole["parameters"][K]>;
type Channels = components["schemas"]["TelemetryMessage"]["channels"];

export const proved = [
  true satisfies Same<Row<"angle_p_gain">["value"], number | null>,
  true satisfies Same<Row<"angle_p_gain">["rom"], number | null>,
  true satisfies Same<Row<"smoothing">["value"], boolean | number | null>,
  true satisfies Same<Row<"torque_mode">["rom"], "on" | "off" | "brake" | number | null>,
  true satisfies Same<One, Row<"angle_p_gain">>,
  true satisfies Same<components["schemas"]["Change"]["key"], keyof Whole["parameters"]>,
  true satisfies Same<keyof Channels, keyof Whole["parameters"]>,
];
