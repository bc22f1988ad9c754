/** The server's OpenAPI document as this page reads it: once, when it is first needed. */

import { signal } from "@preact/signals";
import { API, ask, problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import type { OpenApi } from "./document";

export const openApi = signal<OpenApi | null>(null);
/** Why it could not be read. */
export const openApiTrouble = signal<string | null>(null);

export async function readOpenApi(): Promise<void> {
  if (openApi.peek() !== null) return;
  openApiTrouble.value = null;
  try {
    openApi.value = (await ask("GET", "/openapi.json")) as OpenApi;
  } catch (error) {
    openApiTrouble.value = problemText(problemOf(error));
  }
}

/** Whether this server has the operation: an older one lacks what a newer one has. */
export function has(found: OpenApi | null, verb: string, path: string): boolean {
  return found?.paths[API + path]?.[verb] !== undefined;
}
