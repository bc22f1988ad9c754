/** REST client: one fetch over the generated paths, and problem+json as an error. */
import { ROOT } from "./root";
import type { paths } from "./schema";
import { note, type OnStatus } from "./sent";
import type { ProblemBody } from "./types";

export const API = `${ROOT}/api/v1`;

/** A failed request. `code` is the server's, or "no_link" when it was not reached. */
export class Problem extends Error {
  readonly code: string;
  readonly status: number;
  readonly facts: Readonly<Record<string, unknown>>;

  constructor(code: string, status: number, detail: string, facts: Record<string, unknown> = {}) {
    // The part of the detail for programs is not shown.
    super(typeof facts.summary === "string" ? facts.summary : detail);
    this.name = "Problem";
    this.code = code;
    this.status = status;
    this.facts = facts;
  }
}

type Verb = "GET" | "PUT" | "POST" | "PATCH" | "DELETE";

/** Paths below the root of the API that have a verb. */
export type PathOf<V extends Verb> = {
  [P in keyof paths]: paths[P] extends Record<Lowercase<V>, object>
    ? P extends `/api/v1${infer Rest}`
      ? Rest
      : never
    : never;
}[keyof paths];

type Operation<V extends Verb, P> = P extends string
  ? paths[`/api/v1${P}` & keyof paths] extends Record<Lowercase<V>, infer O>
    ? O
    : never
  : never;

/** Part of the parameters: from the document, or absent. */
type Part<O, K extends string> = O extends { parameters: infer P } ? Pick<P, K & keyof P> : never;

/** A body, read-only. */
type Given<T> = { readonly [K in keyof T]: Given<T[K]> };

type Content<C> =
  | { body: Given<C[keyof C & "application/json"]>; file?: never }
  /** A file as the body, instead of JSON. */
  | { file: { text: string | Blob; type: keyof C & string }; body?: never };

type Body<O> = O extends { requestBody: { content: infer C } }
  ? Content<C>
  : O extends { requestBody?: { content: infer C } }
    ? Content<C> | { body?: never; file?: never }
    : { body?: never; file?: never };

type Headers<O> = O extends { parameters: { header?: infer H } } ? { headers?: H & {} } : { headers?: never };

interface Sending {
  /** Lets the request outlive the page. */
  keepalive?: boolean;
  timeout_ms?: number;
  /** Abandons the request, also one that waits for a free connection. */
  signal?: AbortSignal | undefined;
}

/** One member per path: the parts of several paths are never combined with each other. */
export type CallOptions<V extends Verb, P extends PathOf<V>> = P extends unknown
  ? Sending & Part<Operation<V, P>, "path" | "query"> & Headers<Operation<V, P>> & Body<Operation<V, P>>
  : never;

type Json<R> = R extends { content: { "application/json": infer J } } ? J : undefined;

export type ApiResponse<V extends Verb, P extends PathOf<V>> =
  Operation<V, P> extends { responses: infer R } ? Json<R[keyof R & (200 | 201 | 202 | 204)]> : never;

/** Options may be omitted if none is required. */
type Rest<T> = object extends T ? [options?: T] : [options: T];

interface Plain extends Sending {
  path?: Readonly<Record<string, unknown>>;
  query?: Readonly<Record<string, unknown>>;
  headers?: Record<string, string>;
  body?: unknown;
  file?: { text: string | Blob; type: string };
}

/**
 * Send a request. Resolves to its JSON (undefined for an empty response), rejects with a Problem. Path, parameters,
 * body and response are those of the generated document.
 */
export function callApi<V extends Verb, P extends PathOf<V>>(
  verb: V,
  template: P,
  ...[given]: Rest<CallOptions<V, P>>
): Promise<ApiResponse<V, P>> {
  const options = (given ?? {}) as Plain;
  return reported(verb, filled(template, options), options);
}

async function reported<Result>(verb: Verb, path: string, options: Plain): Promise<Result> {
  const init: RequestInit = {
    method: verb,
    headers: { Accept: "application/json", ...options.headers },
    signal: signalOf(options),
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
  const finished = noted(verb, path, options);
  let response: Response;
  try {
    response = await fetch(API + path, init);
    finished(response.status);
  } catch (error) {
    finished(0);
    throw new Problem("no_link", 0, error instanceof Error ? error.message : String(error));
  }
  const text = await response.text();
  if (response.status === 401 && path !== "/session") unauthorized();
  if (!response.ok) throw toProblem(response.status, text);
  return (text === "" ? undefined : JSON.parse(text)) as Result;
}

/** Aborts after the timeout or with the signal of the caller. AbortSignal.any is too new for older tablets. */
function signalOf({ timeout_ms = 15_000, signal }: Sending): AbortSignal {
  const timeout = AbortSignal.timeout(timeout_ms);
  if (signal === undefined) return timeout;
  if (signal.aborted) return signal;
  const either = new AbortController();
  timeout.addEventListener("abort", () => either.abort(timeout.reason));
  // Removed with the timeout: the signal of the caller may outlive thousands of requests.
  signal.addEventListener("abort", () => either.abort(signal.reason), { signal: timeout });
  return either.signal;
}

/** The path with its parameters, and the query without undefined values. */
function filled(template: string, { path, query }: Plain): string {
  const at = template.replace(/\{(\w+)\}/g, (_, name: string) => encodeURIComponent(String(path?.[name])));
  const search: string[] = [];
  for (const [name, value] of Object.entries(query ?? {})) {
    // Lists stay readable on the API page.
    for (const one of Array.isArray(value) ? value : [value])
      if (one != null) search.push(`${name}=${encodeURIComponent(String(one)).replaceAll("%2C", ",")}`);
  }
  return search.length === 0 ? at : `${at}?${search.join("&")}`;
}

let unauthorized = () => {};

/** Callback for a missing or invalid token. */
export function whenUnauthorized(act: () => void): void {
  unauthorized = act;
}

/** Record the request for the API page, in a form that can be sent from elsewhere. */
function noted(verb: Verb, path: string, options: Plain): OnStatus {
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
    // Not JSON: for example a proxy's page.
  }
  return new Problem(status === 502 || status === 504 ? "no_link" : "unexpected", status, `HTTP ${status}`);
}

/** The Problem of any thrown value. */
export function problemOf(error: unknown): Problem {
  if (error instanceof Problem) return error;
  return new Problem("unexpected", 0, error instanceof Error ? error.message : String(error));
}
