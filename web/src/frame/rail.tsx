/**
 * The left rail: pages in the order of work, each with a badge for what needs attention. A phone shows four of them
 * below, and More.
 */
import { useSignalEffect } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { stopped } from "../bench/bench";
import { complaints } from "../bench/doctor";
import { all, nameOf, servo, uids } from "../bench/fleet";
import { up } from "../bench/link";
import { motion } from "../bench/motion";
import { reload } from "../bench/reload";
import { lastUid, type Page, pathOf, type Route, route } from "../bench/route";
import { phone } from "../bench/screen";
import { severalBenches, silentBenches } from "../bench/site";
import { chooseTheme, type ThemeChoice, themeChoice } from "../bench/theme";
import { follow } from "../kit/follow";
import { Glyph } from "../kit/glyph";
import { guideAt } from "../kit/guide";
import { Icon, type IconName } from "../kit/icon";
import { usePopup } from "../kit/popup";
import { Segments } from "../kit/segments";
import { text } from "../text";
import { chooseLanguage, currentLanguage, LANGUAGES, type Language } from "../text/language";

/** Pages that a phone shows without More. */
const FIRST: ReadonlySet<Page> = new Set(["servos", "motion", "faults", "bus"]);

function nameOfPage(page: Page): string {
  if (page === "missing") return text.missing.page;
  return text.nav[page];
}

/** Title of the browser tab: page and servo. */
function nameTab(): void {
  const { page, uid } = route.value;
  const one = uid === null ? undefined : servo(uid);
  const words = [nameOfPage(page), ...(one ? [nameOf(one)] : [])];
  document.title = `${words.join(", ")} \u2013 ${text.name}`;
}

export function Rail({ onKeys }: { onKeys: () => void }) {
  const known = uids.value;
  const uid =
    lastUid.value !== null && known.includes(lastUid.value) ? lastUid.value : (known[0] ?? route.value.uid);
  useSignalEffect(nameTab);
  const language = currentLanguage();
  const more = useMore();
  const unsaved = all.value.reduce((sum, one) => sum + one.unsaved.length, 0);
  return (
    <aside ref={more.box} class="rail" aria-label={text.nav.label} data-more={more.open.value}>
      <nav>
        <Item page="servos" uid={null} icon="servos" label={text.nav.servos}>
          {known.length > 0 && <span class="badge">{known.length}</span>}
        </Item>
        <Item page="commission" uid={null} icon="commission" label={text.nav.commission} />
        <Item page="matrix" uid={null} icon="matrix" label={text.nav.matrix}>
          {unsaved > 0 && (
            <span class="badge">
              <span class="k-intent">
                <Icon name="half" size={14} />
              </span>
              {unsaved}
              <span class="hidden-text">{text.servos.ramOnly(unsaved)}</span>
            </span>
          )}
        </Item>
        {uid !== null && (
          <Item page="motion" uid={uid} icon="motion" label={text.nav.motion}>
            {motion.value.phase === "on" ? (
              <span class="badge intent">
                ●<span class="word">{text.nav.on}</span>
              </span>
            ) : (
              stopped.value && (
                <span class="badge">
                  <span class="word">{text.nav.stopped}</span>
                </span>
              )
            )}
          </Item>
        )}
        <Item page="scope" uid={null} icon="scope" label={text.nav.scope} />
        <Item page="faults" uid={null} icon="faults" label={text.nav.faults}>
          <FaultsBadge />
        </Item>
        <Item page="bus" uid={null} icon="bus" label={text.nav.bus}>
          <BusBadge />
        </Item>
        <Item page="recorder" uid={null} icon="recorder" label={text.nav.recorder} />
        <Item page="records" uid={null} icon="records" label={text.nav.records} />
        <Item page="api" uid={null} icon="api" label={text.nav.api} />
        {phone.value && (
          <button
            type="button"
            class="rail-item"
            data-first
            data-testid="more"
            aria-expanded={more.open.value}
            aria-current={FIRST.has(shownBy(route.value)) ? undefined : "page"}
            onClick={() => {
              more.open.value = !more.open.peek();
            }}
          >
            <Icon name="more" />
            <span>{text.nav.more}</span>
          </button>
        )}
      </nav>
      <div class="rail-foot">
        {severalBenches.value && (
          <Item page="site" uid={null} icon="site" label={text.nav.site}>
            <SiteBadge />
          </Item>
        )}
        <button type="button" class="rail-item" onClick={onKeys} data-testid="keys">
          <Icon name="keys" />
          <span>{text.keys}</span>
          <kbd class="badge-key">?</kbd>
        </button>
        <a
          class="rail-item"
          href={guideAt("contents")}
          target="_blank"
          rel="noreferrer"
          aria-label={text.docsLabel}
          data-testid="docs"
        >
          <Icon name="docs" />
          <span>{text.docs}</span>
        </a>
        <Segments<ThemeChoice>
          label={text.theme.label}
          chosen={themeChoice.value}
          onChoose={chooseTheme}
          options={[
            { key: "light", label: text.theme.light },
            { key: "dark", label: text.theme.dark },
            { key: "auto", label: text.theme.auto },
          ]}
        />
        <Segments<Language>
          label={text.language}
          chosen={language}
          onChoose={next => chooseLanguage(next, reload)}
          // Changing the language reloads the page, which needs the server.
          locked={!up.value}
          options={[
            { key: "en", label: LANGUAGES.en.name, lang: "en" },
            { key: "ja", label: LANGUAGES.ja.name, lang: "ja" },
          ]}
        />
      </div>
    </aside>
  );
}

/** The rest of the rail on a phone. Closed by another page, a press outside, and Esc. */
function useMore() {
  const { open, box } = usePopup<HTMLElement>();
  useSignalEffect(() => {
    if (route.value) open.value = false;
  });
  return { open, box };
}

/** Skips bar and rail by keyboard. A button rather than a link: the hash of the address is a part of the page. */
export function SkipLink() {
  return (
    <button type="button" class="skip" onClick={() => document.querySelector("main")?.focus()}>
      {text.skip}
    </button>
  );
}

/** Unacknowledged faults. */
function FaultsBadge() {
  const open = all.value.filter(one => (one.unacknowledged ?? 0) > 0);
  if (open.length === 0) return null;
  const total = open.reduce((sum, one) => sum + (one.unacknowledged ?? 0), 0);
  return (
    <span class="badge" data-testid="faults-badge">
      <Glyph kind={open.some(one => one.faults.failure) ? "failure" : "warning"} size={12} />
      {total}
      <span class="hidden-text">{text.nav.unseen}</span>
    </span>
  );
}

/** Benches without contact. */
function SiteBadge() {
  const silent = silentBenches.value;
  if (silent === 0) return null;
  return (
    <span class="badge" data-testid="site-badge">
      <Glyph kind="offline" size={12} />
      {silent}
      <span class="hidden-text">{text.nav.silent}</span>
    </span>
  );
}

/** Findings of the doctor, on every page. */
function BusBadge() {
  const { failure, warning } = complaints.value;
  if (failure + warning === 0) return null;
  return (
    <span class="badge" data-testid="bus-badge">
      {failure > 0 && (
        <>
          <Glyph kind="failure" size={12} />
          {failure}
          <span class="hidden-text">{text.state.counts.failure(failure)}</span>
        </>
      )}
      {warning > 0 && (
        <span class={failure > 0 ? "badge-part word" : "badge-part"}>
          <Glyph kind="warning" size={12} />
          {warning}
          <span class="hidden-text">{text.state.counts.warning(warning)}</span>
        </span>
      )}
    </span>
  );
}

interface ItemProps {
  page: Page;
  uid: string | null;
  icon: IconName;
  label: string;
  children?: ComponentChildren;
}

function Item({ page, uid, icon, label, children }: ItemProps) {
  const path = pathOf(page, uid);
  return (
    <a
      class="rail-item"
      href={path}
      data-first={FIRST.has(page) || undefined}
      aria-current={shownBy(route.value) === page ? "page" : undefined}
      onClick={event => follow(event, path)}
    >
      <Icon name={icon} />
      <span>{label}</span>
      {children}
    </a>
  );
}

/** The item of a page: the tabs of a servo belong to Servos; groups move on Motion. */
function shownBy({ page, uid }: Route): Page {
  return uid !== null && page !== "motion" ? "servos" : page;
}
