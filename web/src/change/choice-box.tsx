/** The boxes for a choice (a group of radio buttons) and for on or off (a switch). */
import { text } from "../text";

interface ChoiceProps {
  row: string;
  label: string;
  choices: readonly { key: string; label: string }[];
  chosen: string | null;
  locked: boolean;
  describedBy: string;
  onChoose: (key: string) => void;
}

export function ChoiceBox({ row, label, choices, chosen, locked, describedBy, onChoose }: ChoiceProps) {
  return (
    <div
      class="segments choice"
      role="radiogroup"
      aria-label={label}
      aria-describedby={describedBy}
      data-testid={`input-${row}`}
    >
      {choices.map(choice => (
        <label key={choice.key} data-chosen={choice.key === chosen} data-locked={locked}>
          <input
            class="hidden-text"
            type="radio"
            name={row}
            data-testid={`input-${row}-${choice.key}`}
            checked={choice.key === chosen}
            disabled={locked}
            onChange={() => onChoose(choice.key)}
          />
          {choice.label}
        </label>
      ))}
    </div>
  );
}

interface SwitchProps {
  id: string;
  row: string;
  on: boolean | null;
  locked: boolean;
  describedBy: string;
  onChange: (on: boolean) => void;
}

export function SwitchBox({ id, row, on, locked, describedBy, onChange }: SwitchProps) {
  return (
    <button
      id={id}
      type="button"
      class="switch"
      role="switch"
      aria-checked={on === true}
      aria-describedby={describedBy}
      data-testid={`input-${row}`}
      disabled={locked || on === null}
      onClick={() => onChange(on !== true)}
    >
      <span class="track" aria-hidden="true" />
      {on === null ? "–" : on ? text.on : text.off}
    </button>
  );
}
