/** Remedies: their sentences, and their command as something to copy. */

import { Copy } from "../kit/copy";
import { busWords as words } from "./words";

export type Piece = { text: string } | { command: string };

/** The sentences and the commands of a remedy, in order. In the page's own texts a command stands in backquotes. */
export function pieces(remedy: string, command?: unknown): Piece[] {
  const marked = typeof command === "string" ? remedy.replaceAll(command, `\`${command}\``) : remedy;
  const parts = marked.split("`").map((part, place) => {
    if (place % 2 === 1) return { command: part };
    const said = place === 0 ? part.trim() : part.replace(/^[\s.;,、。]+/, "").trim();
    return { text: place === 0 ? said : said.charAt(0).toUpperCase() + said.slice(1) };
  });
  return parts.filter(part => "command" in part || part.text !== "");
}

export function Remedy({ text, command }: { text: string; command?: unknown }) {
  return (
    <div class="remedy">
      {pieces(text, command).map(piece =>
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
