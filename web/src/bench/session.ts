/** The signed-in client of this page, and whether a token is required. */
import { signal } from "@preact/signals";
import { callApi, type Problem, problemOf, whenUnauthorized } from "../api/client";
import { linkToken } from "../api/root";
import { reload } from "./reload";

interface Session {
  /** A token is required. */
  required: boolean;
  name: string | null;
  role: "view" | "operate" | "configure" | "admin" | null;
}

export const session = signal<Session | null>(null);

/** True while the server requires a token: the page shows the sign-in form. */
export const signedOut = signal(false);

/** Why the last sign-in failed. */
export const tokenRefused = signal<Problem | null>(null);

const entered = new Set<() => void>();

/** Called after a sign-in: what was refused before may succeed now. */
export function onSignIn(act: () => void): void {
  entered.add(act);
}

/** The name of this client as the server has it: after the name of its token. */
export function signedBy(pageName: string): string {
  const name = session.value?.name;
  return name ? `${name} · ${pageName}` : pageName;
}

function take(found: Session): void {
  const was = signedOut.peek();
  session.value = found;
  signedOut.value = found.required && found.role === null;
  if (was && !signedOut.peek()) for (const act of entered) act();
}

/** Read the session. Without a response nothing changes: the link band reports it. */
export function look(): Promise<void> {
  return callApi("GET", "/session").then(take, () => undefined);
}

export async function signIn(token: string): Promise<boolean> {
  tokenRefused.value = null;
  try {
    const found = await callApi("POST", "/session", { body: { token } });
    signedOut.value = true;
    take(found);
    return true;
  } catch (error) {
    tokenRefused.value = problemOf(error);
    return false;
  }
}

export async function signOut(): Promise<void> {
  await callApi("DELETE", "/session").catch(() => undefined);
  reload();
}

export function startSession(): void {
  whenUnauthorized(() => {
    if (!signedOut.peek()) void look();
  });
  const token = linkToken();
  if (token === null) void look();
  else void signIn(token).then(look);
}
