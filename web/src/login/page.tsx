/** Sign-in form, and the signed-in name at the foot of the page. */

import { useSignal } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { problemText } from "../bench/facts";
import { session, signedOut, signIn, signOut, tokenRefused } from "../bench/session";
import { Note } from "../kit/note";
import { login as strings } from "./words";
import "./login.css";

export function LoginPage() {
  const token = useSignal("");
  const busy = useSignal(false);
  const box = useRef<HTMLInputElement>(null);
  useLayoutEffect(() => box.current?.focus(), []);
  const enter = async (event: Event) => {
    event.preventDefault();
    if (busy.peek() || token.peek().trim() === "") return;
    busy.value = true;
    if (!(await signIn(token.peek().trim()))) box.current?.select();
    busy.value = false;
  };
  const problem = tokenRefused.value;
  return (
    <section class="login" aria-labelledby="login-title">
      <form class="login-box" onSubmit={event => void enter(event)} data-testid="login">
        <h1 id="login-title">{strings.title}</h1>
        <p class="second">{strings.why}</p>
        <label class="login-field">
          <span>{strings.token}</span>
          <input
            ref={box}
            class="field"
            type="password"
            autocomplete="current-password"
            spellcheck={false}
            value={token.value}
            aria-invalid={problem !== null}
            aria-describedby={problem === null ? undefined : "login-refusal"}
            data-testid="login-token"
            onInput={event => {
              token.value = event.currentTarget.value;
            }}
          />
        </label>
        {problem && (
          <Note testid="login-refusal">
            {" "}
            {problem.code === "unauthorized"
              ? strings.unknown
              : problem.code === "too_many_attempts"
                ? strings.tooMany(Number(problem.facts.retry_after_s))
                : problemText(problem)}
          </Note>
        )}
        <button
          type="submit"
          class="button primary"
          disabled={busy.value || token.value.trim() === ""}
          data-testid="login-enter"
        >
          {strings.enter}
        </button>
        <p class="second">{strings.stop}</p>
        <p class="second">
          {strings.how} <code class="mono">hornbill tokens create NAME --role operate</code>
        </p>
      </form>
    </section>
  );
}

/** The signed-in name and Sign out; nothing if no token is required. */
export function SignedIn() {
  const name = session.value?.name;
  const role = session.value?.role;
  if (!name || !role || signedOut.value) return null;
  return (
    <span class="signed-in" data-testid="signed-in">
      <span class="dim">{strings.as(name, strings.roles[role])}</span>
      <button type="button" class="link" onClick={() => void signOut()} data-testid="sign-out">
        {strings.leave}
      </button>
    </span>
  );
}
