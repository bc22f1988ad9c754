/** Segmented control: one of a few. */

interface Props<T extends string> {
  label: string;
  /** `lang`: language of a label, if different from the page's. */
  options: readonly { key: T; label: string; lang?: string }[];
  chosen: T;
  onChoose: (key: T) => void;
  /** Disabled. */
  locked?: boolean;
}

export function Segments<T extends string>({ label, options, chosen, onChoose, locked = false }: Props<T>) {
  return (
    <div class="segments" role="group" aria-label={label}>
      {options.map(option => (
        <button
          key={option.key}
          type="button"
          aria-pressed={option.key === chosen}
          disabled={locked && option.key !== chosen}
          onClick={() => onChoose(option.key)}
          {...(option.lang ? { lang: option.lang } : {})}
        >
          {option.label}
        </button>
      ))}
    </div>
  );
}
