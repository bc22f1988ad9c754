/** The table of what a write changes: a row's name, what is held now, and what it is to become. */
import { addressOf, rowLabelOf, valueText } from "../bench/row-text";

interface Change {
  key: string;
  now: unknown;
  next: unknown;
}

export function BeforeAfter(props: {
  head: { parameter: string; now: string; next: string };
  changes: readonly Change[];
  testid: string;
}) {
  return (
    <table class="changes">
      <thead>
        <tr>
          <th>{props.head.parameter}</th>
          <th class="right">{props.head.now}</th>
          <th class="right">{props.head.next}</th>
        </tr>
      </thead>
      <tbody>
        {props.changes.map(one => (
          <tr key={one.key} data-testid={`${props.testid}-${one.key}`}>
            <td>
              {rowLabelOf(one.key)} <small class="second">{addressOf(one.key)}</small>
            </td>
            <td class="right second">{valueText(one.key, one.now)} →</td>
            <td class="right strong k-intent">{valueText(one.key, one.next)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
