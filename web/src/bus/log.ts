/** The frame log: its state, stored files, start and stop. */

import { signal } from "@preact/signals";
import type { LogFile, LogFormat, LogState } from "../api/bus-types";
import { API, callApi, problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import { type Poll, poll } from "../bench/poll";

const POLL_MS = 1000;

export const log = signal<LogState | null>(null);
export const logs = signal<readonly LogFile[] | null>(null);
export const logProblem = signal<string | null>(null);

async function readState(): Promise<void> {
  try {
    log.value = await callApi("GET", "/bus/log");
  } catch (error) {
    logProblem.value = problemText(problemOf(error));
  }
}

/** Polls the state of the log each second. */
export function watchLog(): Poll {
  return poll(POLL_MS, readState);
}

/** Reads the list of files; the newest first. */
export async function listLogs(): Promise<void> {
  try {
    const found = await callApi("GET", "/bus/logs");
    logs.value = [...found].sort((one, other) => other.modified_at - one.modified_at);
  } catch (error) {
    logProblem.value = problemText(problemOf(error));
  }
}

async function change(act: Promise<LogState | undefined>): Promise<void> {
  logProblem.value = null;
  try {
    const state = await act;
    if (state) log.value = state;
  } catch (error) {
    logProblem.value = problemText(problemOf(error));
  }
  await listLogs();
}

export function startLog(format: LogFormat, name: string | null, limit_mb: number): Promise<void> {
  return change(callApi("POST", "/bus/log", { body: { format, name, limit_mb } }));
}

export function stopLog(): Promise<void> {
  return change(callApi("DELETE", "/bus/log"));
}

export function removeLog(name: string): Promise<void> {
  return change(callApi("DELETE", "/bus/logs/{name}", { path: { name } }));
}

/** Download address of a log. */
export function urlOf(name: string): string {
  return `${API}/bus/logs/${encodeURIComponent(name)}`;
}
