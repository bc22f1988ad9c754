/** Notes on model and firmware, especially those missing in the tables. */
import { text } from "../text";
import type { KnownServo } from "./fleet";

type Model = Pick<
  KnownServo,
  "model" | "model_number" | "hardware_version" | "firmware" | "firmware_note" | "known_model" | "treated_as"
>;

/** True if it is identified and its series is not in the tables: read-only. */
export const readOnly = (one: Pick<Model, "known_model" | "model_number"> | undefined) =>
  one !== undefined && !one.known_model && one.model_number !== null;

/** Its model, as shown in lists. */
export function modelName(one: Pick<Model, "model" | "model_number" | "known_model" | "treated_as">): string {
  if (one.model === null)
    return one.model_number === null
      ? text.servos.unknownModel
      : text.model.unknownSeries(String(one.model_number));
  return one.treated_as.model === null ? one.model : text.model.as(one.model);
}

/** A sentence for each item missing in the tables. */
export function unfamiliar(one: Model): string[] {
  const strings = text.model;
  if (readOnly(one)) return [strings.readOnly(String(one.model_number))];
  const lines: string[] = [];
  if (one.treated_as.model !== null)
    lines.push(strings.otherHardware(String(one.hardware_version), one.treated_as.model));
  if (one.treated_as.firmware !== null && one.firmware !== null)
    lines.push(strings.otherFirmware(one.firmware, one.treated_as.firmware));
  return lines;
}

/** Note on its firmware in the page's language, or the server's. */
export function firmwareNote(one: Pick<Model, "firmware" | "firmware_note">): string | null {
  if (one.firmware === null || one.firmware_note === null) return null;
  return text.model.noteOn(one.firmware, text.table.firmware[one.firmware] ?? one.firmware_note);
}
