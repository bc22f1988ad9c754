/** The picker of channels of a plot, and their requested rate. */
import type { Signal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import type { Channel } from "./channels";
import { plots as words } from "./words";

export const RATES = [5, 20, 50, 100] as const;

interface Props {
  offered: readonly Channel[];
  name: string;
  chosen: Signal<readonly string[]>;
  hz: Signal<number>;
  file: ComponentChildren;
}

export function PlotPicker({ offered, name, chosen, hz, file }: Props) {
  const flip = (key: string) => {
    const now = chosen.peek();
    const next = now.includes(key) ? now.filter(one => one !== key) : [...now, key];
    if (next.length > 0) chosen.value = next;
  };
  return (
    <div class="plot-picker" data-testid="plot-picker">
      <div class="plot-picks" role="group" aria-label={words.channelsOf(name)}>
        {offered.map(one => (
          <label key={one.key} class="plot-pick">
            <input
              type="checkbox"
              data-testid={`plot-channel-${one.key}`}
              checked={chosen.value.includes(one.key)}
              disabled={chosen.value.length === 1 && chosen.value[0] === one.key}
              onChange={() => flip(one.key)}
            />
            {one.label}
            <span class="dim">{one.unit}</span>
          </label>
        ))}
      </div>
      <p class="small second">{words.channelsHint}</p>
      <div class="plot-picks">
        <label class="plot-window">
          {words.requested}
          <select
            data-testid="plot-hz"
            value={String(hz.value)}
            onChange={event => {
              hz.value = Number(event.currentTarget.value);
            }}
          >
            {RATES.map(one => (
              <option key={one} value={String(one)}>
                {words.hz(String(one))}
              </option>
            ))}
          </select>
        </label>
        <span class="grow" />
        {file}
      </div>
    </div>
  );
}
