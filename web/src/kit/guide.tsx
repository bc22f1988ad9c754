/** Links into the documentation that the server serves below /docs/. */
import { ROOT } from "../api/root";
import { text } from "../text";

/** Paths below /docs/, without extension; "" is the table of contents. */
const PLACES = {
  contents: "",
  tutorial: "tutorial",
  adapters: "how-to/adapters",
  commission: "how-to/commission",
  bus: "how-to/bus",
  recover: "how-to/recover",
  faults: "explanation/measuring",
  tuning: "explanation/tuning",
  profiles: "how-to/profiles",
  record: "how-to/record",
  rigs: "rigs",
  move: "how-to/move",
  socket: "reference/websocket",
  reference: "reference/api/index",
} as const;

export type GuidePlace = keyof typeof PLACES;

/** Address of a page of the documentation, also behind a proxy path. */
export function guideAt(place: GuidePlace): string {
  const found = PLACES[place];
  return `${ROOT}/docs/${found === "" ? "" : `${found}.html`}`;
}

/** Links in a row. They open in a new tab, so that staged edits and motion continue here. */
export function Guides({ places }: { places: readonly GuidePlace[] }) {
  return (
    <p class="guides">
      {places.map(place => (
        <a
          key={place}
          class="link"
          href={guideAt(place)}
          target="_blank"
          rel="noreferrer"
          data-testid={`guide-${place}`}
        >
          {text.guides[place]}
        </a>
      ))}
    </p>
  );
}
