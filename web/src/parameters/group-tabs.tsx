/** Tabs of the Parameters page: one per group, with the number of changes. */
import type { ComponentChildren } from "preact";
import type { Row } from "../api/types";
import type { Tab } from "../bench/catalog";
import { staged, wrong } from "../bench/draft";
import { servo } from "../bench/fleet";
import type { Sheet } from "../bench/parameters";
import { aboutTab } from "../bench/row-help";
import { narrow } from "../bench/screen";
import { Icon } from "../kit/icon";
import { tabKeys } from "../kit/tab-keys";
import { text } from "../text";

/** On a narrow screen the live panel is a tab. */
export const LIVE_TAB = "live";

/** The tab to show: that of the parameter in the address, else the last chosen, else the first. */
export function openTab(tabs: readonly Tab[], hash: string, chosen: string): string {
  const linked = hash && tabs.find(tab => tab.rows.some(row => row.key === hash || row.name === hash));
  if (linked) return linked.key;
  const valid = chosen === LIVE_TAB ? narrow.value : tabs.some(tab => tab.key === chosen);
  return valid ? chosen : (tabs[0]?.key ?? "");
}

interface Props {
  sheet: Sheet;
  tabs: readonly Tab[];
  chosen: string;
  onChoose: (tab: string) => void;
  pwm: boolean | null;
  /** Search and filter, at the other end. */
  children?: ComponentChildren;
}

export function Tabs({ sheet, tabs, chosen, onChoose, pwm, children }: Props) {
  const has = sheet.keys.value;
  // Before its rows are known, a servo without PWM input must not show a tab that then goes.
  const present = (row: Row) => has?.includes(row.key) ?? (pwm !== false || row.group !== "pwm");
  const shown = tabs
    .map(tab => ({ ...tab, rows: tab.rows.filter(present) }))
    .filter(tab => tab.rows.length > 0);
  return (
    <div class="tabs">
      <div role="tablist" aria-label={text.params.title} tabIndex={-1} onKeyDown={tabKeys}>
        {shown.map(tab => (
          <TabButton
            key={tab.key}
            tab={tab}
            sheet={sheet}
            selected={chosen === tab.key}
            onChoose={onChoose}
          />
        ))}
        {narrow.value && (
          <button
            type="button"
            role="tab"
            aria-selected={chosen === LIVE_TAB}
            data-testid="tab-live"
            onClick={() => onChoose(LIVE_TAB)}
          >
            {text.params.live}
          </button>
        )}
      </div>
      {pwm === false && <span class="small second touch-hide no-pwm">{text.params.noPwm}</span>}
      <div class="tabs-tools">{children}</div>
    </div>
  );
}

interface TabButtonProps {
  tab: Tab;
  sheet: Sheet;
  selected: boolean;
  onChoose: (tab: string) => void;
}

function TabButton({ tab, sheet, selected, onChoose }: TabButtonProps) {
  const drafts = sheet.drafts.map.value;
  const values = staged(drafts, key => sheet.held(key));
  const bad = wrong(drafts);
  const unsaved = servo(sheet.uid)?.unsaved ?? [];
  const keys = tab.rows.map(row => row.key);
  const isStaged = keys.some(key => values.has(key));
  const isWrong = keys.some(key => bad.includes(key));
  const isHalf = keys.some(key => unsaved.includes(key));
  return (
    <button
      type="button"
      role="tab"
      aria-selected={selected}
      tabIndex={selected ? 0 : -1}
      data-testid={`tab-${tab.key}`}
      title={aboutTab(tab)}
      onClick={() => onChoose(tab.key)}
    >
      {tab.label} <span class="count">{tab.rows.length}</span>
      {isWrong && <span class="k-failure">■</span>}
      {!isWrong && isStaged && <span class="k-intent">●</span>}
      {!isWrong && !isStaged && isHalf && (
        <span class="k-intent">
          <Icon name="half" size={13} />
        </span>
      )}
    </button>
  );
}
