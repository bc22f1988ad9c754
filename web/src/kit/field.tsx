/** Fields bound to a signal (or a similar object), with label, unit, help and error in one form. */
import type { ComponentChildren, JSX } from "preact";
import { useId } from "preact/hooks";
import { Spinner } from "./icon";
import { Note } from "./note";
import "./field.css";

/** What a field reads and writes: a signal, a choice in the address, or a `cell`. */
export interface Cell<T> {
  value: T;
}

export function cell<T>(value: T, put: (value: T) => void): Cell<T> {
  return {
    get value() {
      return value;
    },
    set value(next) {
      put(next);
    },
  };
}

/** Membership of a key in a set. */
export function inSet<T>(set: Cell<ReadonlySet<T>>, key: T): Cell<boolean> {
  return cell(set.value.has(key), on => {
    const next = new Set(set.value);
    if (on) next.add(key);
    else next.delete(key);
    set.value = next;
  });
}

export function negated(of: Cell<boolean>): Cell<boolean> {
  return cell(!of.value, on => {
    of.value = !on;
  });
}

interface Common {
  label: string;
  testid?: string;
  disabled?: boolean;
  /** Error text; true where the error is shown elsewhere. */
  error?: string | boolean | null;
  help?: ComponentChildren;
  /** Label for screen readers only. */
  bare?: boolean;
  /** Label before the control. */
  beside?: boolean;
  short?: boolean;
  class?: string;
}

/** Label and help around a control. */
function Entry(props: Common & { id: string; children: ComponentChildren }) {
  const { id, label, error, help, bare, beside, children } = props;
  return (
    <div class={`entry${beside ? " beside" : ""} ${props.class ?? ""}`}>
      <label for={id} class={bare ? "hidden-text" : ""}>
        {label}
      </label>
      {children}
      {typeof error === "string" ? (
        <div id={`${id}-error`}>
          <Note>{error}</Note>
        </div>
      ) : (
        help && <span class="small second">{help}</span>
      )}
    </div>
  );
}

interface TextProps extends Common {
  at: Cell<string>;
  hint?: string;
  longest?: number;
  /** Numeric input: numeric keyboard, selected on focus. */
  number?: boolean;
  unit?: string;
  refTo?: JSX.IntrinsicElements["input"]["ref"];
}

export function TextField(props: TextProps) {
  const id = useId();
  const { at, error, unit, number, short } = props;
  const wrong = typeof error === "string" || error === true;
  const size = short ? " short" : "";
  const input = (
    <input
      id={id}
      ref={props.refTo ?? null}
      type="text"
      class={unit === undefined ? `field${size}` : ""}
      autocomplete="off"
      spellcheck={false}
      {...(props.testid ? { "data-testid": props.testid } : {})}
      {...(number ? { inputMode: "decimal" as const } : {})}
      {...(props.longest ? { maxLength: props.longest } : {})}
      {...(props.hint ? { placeholder: props.hint } : {})}
      {...(typeof error === "string" ? { "aria-describedby": `${id}-error` } : {})}
      disabled={props.disabled === true}
      aria-invalid={wrong}
      value={at.value}
      onFocus={event => number && event.currentTarget.select()}
      onInput={event => {
        at.value = event.currentTarget.value;
      }}
    />
  );
  return (
    <Entry {...props} id={id}>
      {unit === undefined ? (
        input
      ) : (
        <span class={`box${size}`} data-wrong={wrong}>
          {input}
          <span class="unit">{unit}</span>
        </span>
      )}
    </Entry>
  );
}

interface ChoiceProps extends Common {
  at: Cell<string>;
  options: readonly { key: string; label: string }[];
}

/** One of many, by name. */
export function Choice(props: ChoiceProps) {
  const id = useId();
  const { at, options } = props;
  return (
    <Entry {...props} id={id}>
      <select
        id={id}
        class={`field${props.short ? " short" : ""}`}
        {...(props.testid ? { "data-testid": props.testid } : {})}
        disabled={props.disabled === true}
        value={at.value}
        onChange={event => {
          at.value = event.currentTarget.value;
        }}
      >
        {options.map(one => (
          <option key={one.key} value={one.key}>
            {one.label}
          </option>
        ))}
      </select>
    </Entry>
  );
}

interface TickProps {
  /** Label; with other children, the accessible name. */
  label?: string;
  at: Cell<boolean>;
  testid?: string;
  disabled?: boolean;
  /** Label for screen readers only: a cell of a table. */
  bare?: boolean;
  /** Indeterminate: some of its items are checked. */
  some?: boolean;
  class?: string;
  /** Test ID of the whole, including the label. */
  holder?: string;
  children?: ComponentChildren;
}

export function Tick({ label, at, testid, disabled = false, bare, some, children, ...props }: TickProps) {
  return (
    <label
      class={props.class ?? (bare ? "tick-cell" : "tick")}
      {...(props.holder ? { "data-testid": props.holder } : {})}
    >
      <input
        type="checkbox"
        {...(label && (bare || children) ? { "aria-label": label } : {})}
        {...(testid ? { "data-testid": testid } : {})}
        ref={box => {
          if (box) box.indeterminate = some === true;
        }}
        checked={at.value}
        disabled={disabled}
        onChange={event => {
          at.value = event.currentTarget.checked;
        }}
      />
      {children ?? (bare ? null : <span>{label}</span>)}
    </label>
  );
}

interface FileProps {
  label: string;
  accept: string;
  testid: string;
  busy?: boolean;
  disabled?: boolean;
  title?: string;
  look?: "button" | "tool";
  /** Content before its label. */
  children?: ComponentChildren;
  onFile: (file: File) => void;
}

/** A button that opens a file dialog. The same file can be chosen again. */
export function FilePick(props: FileProps) {
  const { label, accept, testid, busy = false, disabled = false, title, look = "button", onFile } = props;
  return (
    <label class={`${look} file-pick`} data-busy={busy} title={title}>
      {busy && <Spinner />}
      {props.children}
      {label}
      <input
        type="file"
        class="hidden-text"
        aria-label={title}
        accept={accept}
        data-testid={testid}
        disabled={disabled || busy}
        onChange={event => {
          const file = event.currentTarget.files?.[0];
          event.currentTarget.value = "";
          if (file) onFile(file);
        }}
      />
    </label>
  );
}
