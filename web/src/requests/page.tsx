/** The API page: addresses, recent requests as commands, and examples. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { API } from "../api/client";
import { ROOT } from "../api/root";
import { all, nameOf } from "../bench/fleet";
import { version } from "../bench/link";
import { lastUid } from "../bench/route";
import { session } from "../bench/session";
import { Copy } from "../kit/copy";
import { Guides } from "../kit/guide";
import { Scroll } from "../kit/scroll";
import { Segments } from "../kit/segments";
import { text } from "../text";
import { beginning, examples } from "./examples";
import { LastSent } from "./sent";
import { api as words } from "./words";
import "../kit/table.css";
import "./requests.css";

export function ApiPage() {
  return (
    <div class="page api" data-testid="api-page">
      <div class="page-head">
        <h1>{words.title}</h1>
        <span class="second">{words.lead}</span>
      </div>
      <Scroll label={words.title} testid="api-scroll">
        <div class="a-top">
          <div>
            <Part title={words.first.title}>
              <First />
              <Guides places={["reference", "rigs", "move", "socket"]} />
            </Part>
            <Part title={words.sent.title}>
              <LastSent />
            </Part>
          </div>
          <Part title={words.examples.title}>
            <Examples />
          </Part>
        </div>
      </Scroll>
    </div>
  );
}

function Part({ title, children }: { title: string; children: ComponentChildren }) {
  return (
    <section class="a-part" aria-label={title}>
      <h2>{title}</h2>
      {children}
    </section>
  );
}

function First() {
  const { origin, host, protocol } = location;
  const strings = words.first;
  const who = session.value;
  return (
    <dl class="a-facts">
      <Fact name={strings.address} value={`${origin}${API}`} />
      <Fact
        name={strings.document}
        value={`${origin}${API}/openapi.json`}
        link="api-document"
        hint={strings.documentHint}
      />
      <Fact name={strings.docs} value={`${origin}${ROOT}/docs/`} link="api-docs" hint={strings.docsHint} />
      <Fact
        name={strings.socket}
        value={`${protocol === "https:" ? "wss" : "ws"}://${host}${API}/ws`}
        hint={strings.socketHint}
      />
      <div>
        <dt>{strings.version}</dt>
        <dd>{version.value === "" ? text.empty.loading : `hornbill ${version.value}`}</dd>
      </div>
      <div data-testid="api-session">
        <dt>{strings.session}</dt>
        <dd>
          {who === null
            ? text.empty.loading
            : who.name && who.role
              ? strings.sessionOf(who.name, who.role)
              : strings.sessionOpen}
        </dd>
      </div>
    </dl>
  );
}

function Fact({ name, value, hint, link }: { name: string; value: string; hint?: string; link?: string }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>
        {link ? (
          <a class="link mono" href={value} target="_blank" rel="noreferrer" data-testid={link}>
            {value}
          </a>
        ) : (
          <span class="mono">{value}</span>
        )}
        {hint !== undefined && <small>{hint}</small>}
      </dd>
      <dd class="a-tool">
        <Copy what={value} words={words.first} label={words.first.copyOf(name)} />
      </dd>
    </div>
  );
}

/** Placeholder in the examples while no servo is known. */
const ANY = "<uid>";

function Examples() {
  const form = useSignal<"curl" | "python">("curl");
  const servos = all.value;
  const one = servos.find(servo => servo.uid === lastUid.value) ?? servos[0];
  const strings = words.examples;
  const start = beginning(location.origin + ROOT)[form.value];
  return (
    <>
      <div class="a-search">
        <p class="second grow">{one ? strings.lead(nameOf(one)) : strings.leadNone}</p>
        <Segments
          label={strings.language}
          chosen={form.value}
          onChoose={key => {
            form.value = key;
          }}
          options={[
            { key: "curl", label: strings.curl },
            { key: "python", label: strings.python },
          ]}
        />
      </div>
      <ol class="a-examples" data-testid="api-examples">
        <Code title={strings.begin} code={start} />
        {examples(one?.uid ?? ANY).map(each => (
          <Code key={each.key} title={strings[each.key]} code={each[form.value]} />
        ))}
      </ol>
      <p class="w-line dim">{strings.token}</p>
    </>
  );
}

function Code({ title, code }: { title: string; code: string }) {
  return (
    <li>
      <div class="a-code-head">
        <span class="grow">{title}</span>
        <Copy what={code} words={words.first} label={words.first.copyOf(title)} />
      </div>
      {/* Scrolls separately: reached with Tab, scrolled with the arrow keys. */}
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: a scrollable region must be reachable */}
      <pre class="mono" tabIndex={0} role="region" aria-label={title}>
        {code}
      </pre>
    </li>
  );
}
