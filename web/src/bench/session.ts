/** Who is signed in on this page, and whether somebody has to be. */
import { signal } from "@preact/signals";
import { ask, type Problem, problemOf, whenUnauthorized } from "../api/client";
import { linkToken } from "../api/root";
import { reload } from "./reload";

interface Session {
  /** Whether a token is needed. */
  required: boolean;
  name: string | null;
  role: "view" | "operate" | "configure" | "admin" | null;
}

export const session = signal<Session | null>(null);

/** True while the server wants a token from us: the page shows where to give it. */
export const signedOut = signal(false);

/** Why the last attempt to sign in failed. */
export const tokenRefused = signal<Problem | null>(null);

const entered = new Set<() => void>();

/** Told when somebody has signed in: what was refused before may go now. */
export function onSignIn(act: () => void): void {
  entered.add(act);
}

/** What we call ourselves, as the server will have it: after the name it knows us by. */
export function signedBy(said: string): string {
  const name = session.value?.name;
  return name ? `${name} · ${said}` : said;
}

function take(found: Session): void {
  const was = signedOut.peek();
  session.value = found;
  signedOut.value = found.required && found.role === null;
  if (was && !signedOut.peek()) for (const act of entered) act();
}

/** Asks the server who we are. Without an answer nothing changes: the link says that it is gone. */
export function look(): Promise<void> {
  return ask("GET", "/session").then(take, () => undefined);
}

export async function signIn(token: string): Promise<boolean> {
  tokenRefused.value = null;
  try {
    const found = await ask("POST", "/session", { body: { token } });
    signedOut.value = true;
    take(found);
    return true;
  } catch (error) {
    tokenRefused.value = problemOf(error);
    return false;
  }
}

export async function signOut(): Promise<void> {
  await ask("DELETE", "/session").catch(() => undefined);
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
