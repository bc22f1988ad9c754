/** REST: one typed fetch, and problem+json as an error that can be branched on. */
import { ROOT } from "./root";
import { type Answered, note } from "./sent";
import type { ProblemBody } from "./types";

export const API = `${ROOT}/api/v1`;

/** Why a request did not do what was asked. `code` is the server's, or "no_link" when it was not reached. */
export class Problem extends Error {
  readonly code: string;
  readonly status: number;
  readonly facts: Readonly<Record<string, unknown>>;

  constructor(code: string, status: number, detail: string, facts: Record<string, unknown> = {}) {
    // What programs are told is of no use here.
    super(typeof facts.summary === "string" ? facts.summary : detail);
    this.name = "Problem";
    this.code = code;
    this.status = status;
    this.facts = facts;
  }
}

export interface AskOptions {
  body?: unknown;
  /** A file as the body, instead of JSON. */
  file?: { text: string | Blob; type: string };
  headers?: Record<string, string>;
  /** Lets the request outlive the page: for what must go out while leaving. */
  keepalive?: boolean;
  timeout_ms?: number;
}

type Verb = "GET" | "PUT" | "POST" | "PATCH" | "DELETE";

/** Asks the server; resolves to its JSON (undefined for an empty answer), rejects with a Problem. */
export async function ask<Answer>(verb: Verb, path: string, options: AskOptions = {}): Promise<Answer> {
  const init: RequestInit = {
    method: verb,
    headers: { Accept: "application/json", ...options.headers },
    signal: AbortSignal.timeout(options.timeout_ms ?? 15_000),
  };
  if (options.keepalive) init.keepalive = true;
  if (options.body !== undefined) {
    init.body = JSON.stringify(options.body);
    init.headers = { ...init.headers, "Content-Type": "application/json" };
  }
  if (options.file) {
    init.body = options.file.text;
    init.headers = { ...init.headers, "Content-Type": options.file.type };
  }
  const answered = noted(verb, path, options);
  let answer: Response;
  try {
    answer = await fetch(API + path, init);
    answered(answer.status);
  } catch (error) {
    answered(0);
    throw new Problem("no_link", 0, error instanceof Error ? error.message : String(error));
  }
  const text = await answer.text();
  if (answer.status === 401 && path !== "/session") unauthorized();
  if (!answer.ok) throw toProblem(answer.status, text);
  return (text === "" ? undefined : JSON.parse(text)) as Answer;
}

let unauthorized = () => {};

/** Told when the server wants a token that we have not, or no more. */
export function whenUnauthorized(act: () => void): void {
  unauthorized = act;
}

/** Keeps the request for the API page, as it can be sent from elsewhere. */
function noted(verb: Verb, path: string, options: AskOptions): Answered {
  const { body, file, headers } = options;
  return note({ verb, path: API + path, body, file: file?.type, headers });
}

function toProblem(status: number, text: string): Problem {
  try {
    const body = JSON.parse(text) as Partial<ProblemBody>;
    if (typeof body.code === "string") {
      return new Problem(body.code, status, body.detail ?? body.title ?? body.code, body);
    }
  } catch {
    // Not JSON: a proxy's page, for one.
  }
  return new Problem(status === 502 || status === 504 ? "no_link" : "unexpected", status, `HTTP ${status}`);
}

/** The Problem in whatever was thrown. */
export function problemOf(error: unknown): Problem {
  if (error instanceof Problem) return error;
  return new Problem("unexpected", 0, error instanceof Error ? error.message : String(error));
}
