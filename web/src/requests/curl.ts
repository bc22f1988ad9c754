/** A request of this page as a shell command. */
import type { Sent } from "../api/sent";

/** A quoted word for a POSIX shell. */
export function quoted(word: string): string {
  return /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}

/** Headers that a copied command must not contain: a reader could act as this page. */
const SECRET = new Set(["authorization", "cookie"]);

/** The request as a curl command. The token and the ID of a lease of this page are shell variables. */
export function asCurl(sent: Sent, origin: string): string {
  const parts = ["curl -sS"];
  if (sent.verb !== "GET") parts.push(`-X ${sent.verb}`);
  parts.push(quoted(origin + sent.path));
  parts.push('-H "Authorization: Bearer $HORNBILL_TOKEN"');
  for (const [name, value] of Object.entries(sent.headers ?? {})) {
    if (name.toLowerCase() === "lease") parts.push('-H "Lease: $LEASE"');
    else if (!SECRET.has(name.toLowerCase())) parts.push(`-H ${quoted(`${name}: ${value}`)}`);
  }
  if (sent.file !== undefined)
    parts.push(`-H ${quoted(`Content-Type: ${sent.file}`)}`, "--data-binary @FILE");
  else if (sent.body !== undefined) {
    parts.push(
      "-H 'Content-Type: application/json'",
      `-d ${quoted(JSON.stringify(withoutLease(sent.body)))}`,
    );
  }
  return parts.join(" \\\n  ");
}

/** Removes a lease of this page from a body. */
export function withoutLease(body: unknown): unknown {
  if (typeof body !== "object" || body === null || Array.isArray(body)) return body;
  return Object.fromEntries(Object.entries(body).filter(([key]) => key !== "lease" && key !== "lease_id"));
}
