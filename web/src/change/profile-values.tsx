/** The table of what a profile sets. */
import type { Profile } from "../api/config-types";
import { addressOf, rowLabelOf, valueText } from "../bench/row-text";

interface Props {
  one: Profile;
  label: string;
  head: { parameter: string; value: string };
}

export function ProfileValues({ one, label, head }: Props) {
  return (
    <table class="changes" aria-label={label}>
      <thead>
        <tr>
          <th>{head.parameter}</th>
          <th class="right">{head.value}</th>
        </tr>
      </thead>
      <tbody>
        {Object.entries(one.values).map(([key, value]) => (
          <tr key={key}>
            <td>
              {rowLabelOf(key)} <small class="second">{addressOf(key)}</small>
            </td>
            <td class="right">{valueText(key, value, one.units[key] ?? "")}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
