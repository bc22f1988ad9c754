/** The Copy button: puts a text on the clipboard, and says so. */
import { useSignal } from "@preact/signals";
import { Icon } from "./icon";

const COPIED_MS = 2000;

interface Props {
  what: string;
  words: { copy: string; copied: string };
  /** What is copied, for screen readers; it begins with `words.copy`. */
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

/** The clipboard is there only on https and on this machine; elsewhere the old way still works. */
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
