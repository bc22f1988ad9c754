/** Owns how a remedy is shown: its sentence, and its command as something to copy. */
import { useSignal } from "@preact/signals";
import { words } from "../text/en/bus";
import { Icon } from "../ui/icon";

export type Piece = { text: string } | { command: string };

/** A command stands in backquotes, or begins with sudo and reaches to the end of its sentence. */
const COMMAND = /`([^`]+)`|\bsudo .+?(?=, then |[.;](?:\s|$)|$)/g;

/** The sentences and the commands of a remedy, in order. */
export function pieces(remedy: string): Piece[] {
  const out: Piece[] = [];
  let from = 0;
  for (const found of remedy.matchAll(COMMAND)) {
    const before = remedy.slice(from, found.index).trim();
    if (before !== "") out.push({ text: before });
    out.push({ command: found[1] ?? found[0].trim() });
    from = found.index + found[0].length;
  }
  const rest = remedy
    .slice(from)
    .replace(/^[\s.;,]+/, "")
    .trim();
  if (rest !== "") out.push({ text: rest.charAt(0).toUpperCase() + rest.slice(1) });
  return out;
}

export function Remedy({ text }: { text: string }) {
  return (
    <div class="remedy">
      {pieces(text).map(piece =>
        "command" in piece ? (
          <Command key={piece.command} command={piece.command} />
        ) : (
          <p key={piece.text}>{piece.text}</p>
        ),
      )}
    </div>
  );
}

const COPIED_MS = 2000;

function Command({ command }: { command: string }) {
  const copied = useSignal(false);
  const copy = async () => {
    copied.value = await toClipboard(command);
    if (copied.value) setTimeout(() => (copied.value = false), COPIED_MS);
  };
  return (
    <div class="command">
      <code class="mono">{command}</code>
      <button type="button" class="tool" onClick={() => void copy()}>
        <Icon name={copied.value ? "tick" : "copy"} size={15} />
        <span aria-live="polite">{copied.value ? words.connectDialog.copied : words.connectDialog.copy}</span>
      </button>
    </div>
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
