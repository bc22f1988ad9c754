/** What is said of a servo's model and firmware, above all where the tables do not have them. */
import { text } from "../text";
import type { KnownServo } from "./fleet";

type Model = Pick<
  KnownServo,
  "model" | "model_number" | "hardware_version" | "firmware" | "firmware_note" | "known_model" | "treated_as"
>;

/** Whether it said what it is and no table has its series: it is read, and neither written nor moved. */
export const readOnly = (one: Pick<Model, "known_model" | "model_number"> | undefined) =>
  one !== undefined && !one.known_model && one.model_number !== null;

/** Its model as lists have it. */
export function modelName(one: Pick<Model, "model" | "model_number" | "known_model" | "treated_as">): string {
  if (one.model === null)
    return one.model_number === null
      ? text.servos.unknownModel
      : text.model.unknownSeries(String(one.model_number));
  return one.treated_as.model === null ? one.model : text.model.as(one.model);
}

/** A sentence for each thing that the tables do not have. */
export function unfamiliar(one: Model): string[] {
  const said = text.model;
  if (readOnly(one)) return [said.readOnly(String(one.model_number))];
  const lines: string[] = [];
  if (one.treated_as.model !== null)
    lines.push(said.otherHardware(String(one.hardware_version), one.treated_as.model));
  if (one.treated_as.firmware !== null && one.firmware !== null)
    lines.push(said.otherFirmware(one.firmware, one.treated_as.firmware));
  return lines;
}

/** What users of its firmware should know, in the page's language; the server's words where it has none. */
export function firmwareNote(one: Pick<Model, "firmware" | "firmware_note">): string | null {
  if (one.firmware === null || one.firmware_note === null) return null;
  return text.model.noteOn(one.firmware, text.table.firmware[one.firmware] ?? one.firmware_note);
}
