/** The Copy button: copies a text to the clipboard and confirms it. */
import { useSignal } from "@preact/signals";
import { Icon } from "./icon";

const COPIED_MS = 2000;

interface Props {
  what: string;
  words: { copy: string; copied: string };
  /** Accessible name; starts with `words.copy`. */
  label?: string;
  testid?: string;
}

export function Copy({ what, words, label, testid }: Props) {
  const copied = useSignal(false);
  const copy = async () => {
    copied.value = await toClipboard(what);
    if (copied.value) setTimeout(() => (copied.value = false), COPIED_MS);
  };
  return (
    <button
      type="button"
      class="tool"
      onClick={() => void copy()}
      {...(label && !copied.value ? { "aria-label": label } : {})}
      {...(testid ? { "data-testid": testid } : {})}
    >
      <Icon name={copied.value ? "tick" : "copy"} size={15} />
      <span aria-live="polite">{copied.value ? words.copied : words.copy}</span>
    </button>
  );
}

/** The clipboard API exists only on https and localhost; elsewhere the old command still works. */
async function toClipboard(text: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const box = document.createElement("textarea");
    box.value = text;
    box.className = "hidden-text";
    document.body.append(box);
    box.select();
    const done = document.execCommand("copy");
    box.remove();
    return done;
  }
}
