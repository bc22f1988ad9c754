/** "Show what happened": link to the recording of a fault or stop. */
import { pathOf } from "../bench/route";
import { follow } from "../kit/follow";
import { text } from "../text";

/** `from` and `to`: first and last occurrence, seconds since 1970 UTC. */
export function HappenedLink({ from, to }: { from: number; to: number }) {
  const path = pathOf("recorder", null, "", { from: String(from), to: String(to) });
  return (
    <a class="link" href={path} data-testid="happened-link" onClick={event => follow(event, path)}>
      {text.stop.happened}
    </a>
  );
}
