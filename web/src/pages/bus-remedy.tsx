/** Owns how a remedy is shown: its sentence, and its command as something to copy. */
import { bus as words } from "../text/topics";
import { Copy } from "../ui/copy";

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

function Command({ command }: { command: string }) {
  return (
    <div class="command">
      <code class="mono">{command}</code>
      <Copy what={command} words={words.connectDialog} />
    </div>
  );
}
