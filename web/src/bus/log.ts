/** The log of frames to a file: its state, the files there are, and starting and ending it. */

import { signal } from "@preact/signals";
import type { LogFile, LogFormat, LogState } from "../api/bus-types";
import { API, ask, problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import { type Poll, poll } from "../bench/poll";

const ASK_MS = 1000;

export const log = signal<LogState | null>(null);
export const logs = signal<readonly LogFile[] | null>(null);
export const logProblem = signal<string | null>(null);

async function look(): Promise<void> {
  try {
    log.value = await ask("GET", "/bus/log");
  } catch (error) {
    logProblem.value = problemText(problemOf(error));
  }
}

/** Asks each second how far the log is; the answer ends it. */
export function watchLog(): Poll {
  return poll(ASK_MS, look);
}

/** Reads the list of files; the newest first. */
export async function listLogs(): Promise<void> {
  try {
    const found = await ask("GET", "/bus/logs");
    logs.value = [...found].sort((one, other) => other.modified_at - one.modified_at);
  } catch (error) {
    logProblem.value = problemText(problemOf(error));
  }
}

async function does(act: Promise<LogState | undefined>): Promise<void> {
  logProblem.value = null;
  try {
    const answer = await act;
    if (answer) log.value = answer;
  } catch (error) {
    logProblem.value = problemText(problemOf(error));
  }
  await listLogs();
}

export function startLog(format: LogFormat, name: string | null, limit_mb: number): Promise<void> {
  return does(ask("POST", "/bus/log", { body: { format, name, limit_mb } }));
}

export function stopLog(): Promise<void> {
  return does(ask("DELETE", "/bus/log"));
}

export function removeLog(name: string): Promise<void> {
  return does(ask("DELETE", "/bus/logs/{name}", { path: { name } }));
}

/** Where a browser downloads a log from. */
export function urlOf(name: string): string {
  return `${API}/bus/logs/${encodeURIComponent(name)}`;
}
